// How a session comes to a frame: what it depends on, who has it already, its turn in the queue.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <condition_variable>

#include "core/Error.h"
#include "core/KeptFiles.h"
#include "core/Timer.h"
#include "server/Refusal.h"
#include "server/Session.h"
#include "shot/JobInputs.h"
#include "shot/Parameters.h"

namespace virga::server {
namespace {

constexpr int prefetchPriority = -1000;  // behind everything that a client may say

/// "\"0123456789abcdef...\"": 128 bits of what an answer depends on.
std::string etagOf(const std::string& key)
{
    return fmt::format("\"{:016x}{:016x}\"", contentHash(key), contentHash("second half|" + key));
}

bool holdsTag(std::string_view list, std::string_view etag)
{
    return list == "*" || list.find(etag) != std::string_view::npos;
}

std::string windowText(const Window& w) { return fmt::format("{},{},{},{}", w.x, w.y, w.width, w.height); }

}  // namespace

/// A request on its way, seen by the newer ones of its viewer.
struct Session::Flight {
    std::mutex mutex;
    std::condition_variable changed;
    bool isDone = false, isOvertaken = false;
    std::exception_ptr error;
    std::shared_ptr<const Picture> picture;
    double render_ms = 0;
    std::atomic<bool> isWanted = true, hasBegun = false;

    void finish(std::shared_ptr<const Picture> result, std::exception_ptr problem)
    {
        {
            const std::lock_guard lock(mutex);
            picture = std::move(result);
            error = std::move(problem);
            isDone = true;
        }
        changed.notify_all();
    }
    void overtake()
    {
        {
            const std::lock_guard lock(mutex);
            isOvertaken = true;
            isWanted = false;
        }
        changed.notify_all();
    }
    void checkOvertaken()
    {
        const std::lock_guard lock(mutex);
        if (isOvertaken && !isDone)
            throw Refusal(409, "overtaken", "a newer request of the same viewer has overtaken this one");
    }
};

std::shared_ptr<Session::Flight> Session::takeOff(const std::string& viewer)
{
    auto flight = std::make_shared<Flight>();
    if (viewer.empty()) return flight;
    std::shared_ptr<Flight> older;
    {
        const std::lock_guard lock(mutex_);
        std::erase_if(viewers_, [](const auto& entry) { return entry.second.expired(); });
        older = viewers_[viewer].lock();
        viewers_[viewer] = flight;
    }
    if (older) older->overtake();
    return flight;
}

Session::Prepared Session::prepare(const FrameQuery& query)
{
    Prepared result;
    shot::Settings given = settings();
    changeSettings(given, query.changes);
    RenderTask& task = result.task;
    task.query = query;
    task.settings = services_.folder.resolve(given);
    for (const shot::Parameter& p : shot::parameters()) task.settingsKey += shot::toText(task.settings, p) + "\n";

    const std::lock_guard lock(inputsMutex_);
    const std::string platePath = plateName();
    result.shelf = shelfFor(task.settings, platePath);
    const io::PlateInfo& plate = result.shelf->info();
    checkPixels(plate.width, plate.height, query.view.scale);
    if (!query.view.region.isEmpty()) checkPixels(query.view.region.width, query.view.region.height, 1);
    const FrameNumber asked =
        query.time_s ? plate.frames.front() + FrameNumber(std::floor(*query.time_s * plate.fps + 1e-6)) : query.frame;
    result.plateFrame = result.shelf->standIn(asked);
    result.plateStamp = ServedFolder::stampOf(platePath, result.plateFrame);
    if (result.plateStamp.empty() && shot::onErrorOf(task.settings) == io::OnError::Stop)
        throw Refusal(422, "input", "plate '{}', frame {}: is no longer there", plateName_, result.plateFrame);

    const shot::Settings& s = task.settings;
    std::string fileStamps, steadyStamps;  // the latter of files that are read once for all frames
    for (const std::string* path : {&s.depth, &s.env, &s.lights, &s.mattes, &s.camera, &s.gradeFrom, &s.ocio}) {
        if (path->empty()) continue;
        fileStamps += *path + ServedFolder::stampOf(*path, query.frame) + "|";
        if (!io::isFramePattern(*path)) steadyStamps += *path + ServedFolder::stampOf(*path, 0) + "|";
    }
    task.inputs = inputsFor(s, steadyStamps, query.wantsLayers());
    result.pictureKey =
        fmt::format("{}|{}|{}|{}|{}|{}|{}|{}|{}|{}|{}|{}", platePath, task.settingsKey, task.inputs->key, fileStamps,
                    query.frame, result.plateFrame, result.plateStamp, query.view.scale, query.view.later,
                    windowText(query.view.region), windowText(query.dataWindow), query.wantsLayers());
    return result;
}

std::shared_ptr<const Picture> Session::pictureOf(Prepared& prepared, const std::shared_ptr<Flight>& flight,
                                                  const IsGone& isGone, FrameAnswer& answer)
{
    const bool isAsked = prepared.task.query.priority != prefetchPriority;
    if (auto kept = services_.pictures.find(prepared.pictureKey)) {
        answer.cache = "picture";
        if (isAsked) services_.metrics.countCache(Metrics::Cache::Picture);
        return kept;
    }
    if (services_.queue->waiting() >= services_.limits.queue)
        throw Refusal(503, "busy", "{} frames wait to be rendered; no more are taken", services_.limits.queue);
    if (isAsked) services_.metrics.countCache(Metrics::Cache::Missed);
    flight->checkOvertaken();
    prepared.task.plate = prepared.shelf->read(prepared.plateFrame, prepared.plateStamp);
    if (!prepared.task.plate)
        throw Refusal(422, "input", "frame {}: is damaged, and on-error leaves such frames out", prepared.plateFrame);
    flight->checkOvertaken();

    const auto work = [self = shared_from_this(), flight, task = prepared.task,
                       key = prepared.pictureKey](const shot::RenderQueue::Ticket& ticket) {
        flight->hasBegun = true;
        try {
            std::shared_ptr<const Picture> picture = self->services_.pictures.find(key);
            if (!picture) {
                const Timer clock;
                std::map<std::string, double> passMs;
                auto made = std::make_shared<Picture>(self->renderer_->render(
                    task, [&](double) { return flight->isWanted && !ticket.isCancelled(); }, passMs));
                flight->render_ms = clock.milliseconds();
                self->services_.metrics.countRender(clock.seconds(), passMs);
                self->services_.pictures.keep(key, made, made->bytes());
                picture = std::move(made);
            }
            flight->finish(std::move(picture), nullptr);
        } catch (...) {
            flight->finish(nullptr, std::current_exception());
        }
    };
    shot::RenderQueue::Ticket ticket = services_.queue->submit(prepared.task.query.priority, work);
    std::unique_lock lock(flight->mutex);
    while (!flight->isDone && !flight->isOvertaken) {
        flight->changed.wait_for(lock, std::chrono::milliseconds(20));
        if (flight->isDone || flight->isOvertaken) break;
        lock.unlock();
        const bool gone = isGone();
        lock.lock();
        if (!gone || flight->isDone) continue;
        flight->isWanted = false;
        ticket.cancel();
        if (isAsked) services_.metrics.countGone();
        throw Refusal(409, "gone", "the client went away");
    }
    if (!flight->isDone) {
        ticket.cancel();
        services_.metrics.countOvertaken();
        throw Refusal(409, "overtaken", "a newer request of the same viewer has overtaken this one");
    }
    if (flight->error) std::rethrow_exception(flight->error);
    answer.render_ms = flight->render_ms;
    return flight->picture;
}

void Session::encode(const Picture& picture, const Prepared& prepared, Format format, FrameAnswer& answer)
{
    const io::PlateInfo& plate = prepared.shelf->info();
    const FrameQuery& query = prepared.task.query;
    answer.data = picture.data;
    if (format == Format::Shared) {
        const std::unique_ptr<SharedBlock> block = encodeShared(picture, plate, query);
        answer.sharedName = block->name();
        answer.sharedBytes = block->bytes();
        services_.shared.keep(*block);
        return;
    }
    answer.body = std::make_shared<const std::string>(
        format == Format::Raw ? encodeRaw(picture, plate, query)
                              : encodeImage(picture, plate, prepared.task.settings, query, format));
    services_.bodies.keep(answer.etag, answer.body, answer.body->size());
}

FrameAnswer Session::frame(const FrameQuery& query, Format format, std::string_view ifNoneMatch, const IsGone& isGone)
{
    const Use use(*this);
    const std::shared_ptr<Flight> flight = takeOff(query.viewer);
    Prepared prepared = prepare(query);
    FrameAnswer answer;
    answer.etag = etagOf(fmt::format("{}|{}|{}|{}|{}|{}", prepared.pictureKey, typeOf(format), query.colorspace,
                                     query.isFloat, query.quality, fmt::join(query.layers, ",")));
    answer.data = query.view.region;
    if (answer.data.isEmpty()) {
        const io::PlateInfo& plate = prepared.shelf->info();
        answer.data = shot::frameAt(plate.width, plate.height, query.view.scale);
    }
    if (format != Format::Shared) {
        if (holdsTag(ifNoneMatch, answer.etag)) {
            services_.metrics.countCache(Metrics::Cache::Unchanged);
            answer.isUnchanged = true;
            answer.cache = "unchanged";
            return answer;
        }
        if ((answer.body = services_.bodies.find(answer.etag))) {
            services_.metrics.countCache(Metrics::Cache::Body);
            answer.cache = "body";
            return answer;
        }
    }
    const std::shared_ptr<const Picture> picture = pictureOf(prepared, flight, isGone, answer);
    encode(*picture, prepared, format, answer);
    return answer;
}

FrameAnswer Session::plate(const FrameQuery& query, Format format, std::string_view ifNoneMatch)
{
    const Use use(*this);
    if (!(query.view == shot::View{}) || query.wantsLayers() || !query.dataWindow.isEmpty() || query.time_s)
        throw Refusal(400, "invalid-argument",
                      "a plate comes whole: without region, scale, time, layers and data window");
    Prepared prepared;
    prepared.task.query = query;
    shot::Settings given = settings();
    changeSettings(given, query.changes);
    prepared.task.settings = services_.folder.resolve(given);
    {
        const std::lock_guard lock(inputsMutex_);
        const std::string platePath = plateName();
        prepared.shelf = shelfFor(prepared.task.settings, platePath);
        prepared.plateFrame = prepared.shelf->standIn(query.frame);
        prepared.plateStamp = ServedFolder::stampOf(platePath, prepared.plateFrame);
        prepared.pictureKey = fmt::format("{}|{}|", platePath, shelfKey_);
    }
    FrameAnswer answer;
    answer.etag = etagOf(fmt::format("plate|{}|{}|{}|{}|{}|{}|{}|{}", prepared.pictureKey, prepared.plateFrame,
                                     prepared.plateStamp, typeOf(format), query.colorspace, query.isFloat,
                                     query.quality, prepared.task.settings.outputColorspace));
    if (holdsTag(ifNoneMatch, answer.etag)) {
        answer.isUnchanged = true;
        answer.cache = "unchanged";
        return answer;
    }
    if (format != Format::Shared && (answer.body = services_.bodies.find(answer.etag))) {
        answer.cache = "body";
        return answer;
    }
    const std::shared_ptr<const io::PlateFrame> frame = prepared.shelf->read(prepared.plateFrame, prepared.plateStamp);
    if (!frame)
        throw Refusal(422, "input", "frame {}: is damaged, and on-error leaves such frames out", prepared.plateFrame);
    Picture picture;
    picture.frame.number = frame->number;
    picture.frame.beauty = frame->pixels;
    picture.frame.extras = frame->extras;
    picture.frame.isPlate = true;
    picture.frameWidth = frame->pixels.width();
    picture.frameHeight = frame->pixels.height();
    picture.data = {0, 0, picture.frameWidth, picture.frameHeight};
    encode(picture, prepared, format, answer);
    return answer;
}

void Session::prefetch(const FrameQuery& query)
{
    const Use use(*this);
    FrameQuery quiet = query;
    quiet.priority = prefetchPriority;
    quiet.viewer.clear();
    Prepared prepared = prepare(quiet);
    if (services_.pictures.find(prepared.pictureKey)) return;
    FrameAnswer answer;
    const std::shared_ptr<Flight> flight = takeOff({});
    const auto othersWait = [&] { return services_.queue->waiting() > (flight->hasBegun ? 0U : 1U); };
    pictureOf(prepared, flight, othersWait, answer);
    services_.metrics.countPrefetched();
}

}  // namespace virga::server
