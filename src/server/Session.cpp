#include "server/Session.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/Error.h"
#include "io/AtomicFile.h"
#include "io/ImageFile.h"
#include "server/Refusal.h"
#include "shot/CameraTrack.h"
#include "shot/JobInputs.h"
#include "shot/Parameters.h"

namespace virga::server {
namespace {

/// What the track, the frame rate and the samples of a plate depend on. Other parameters change a compositor.
bool goesIntoInputs(std::string_view parameter)
{
    return parameter.starts_with("camera") || parameter == "fps" || parameter == "first-frame" ||
           parameter == "env-frames" || parameter == "grade-from";
}

}  // namespace

Services::Services(const std::string& root, const std::string& device_, std::string cacheFolder_,
                   const EngineLimits& limits_)
    : limits(limits_), folder(root), cacheFolder(std::move(cacheFolder_)), device(device_),
      pictures(limits_.cacheBytes / 2), bodies(limits_.cacheBytes / 2),
      shared(limits_.sharedBytes, std::chrono::seconds(60)), queue(shot::RenderQueue::ofProcess())
{
}

Session::Session(std::string id, const SessionDocument& document, Services& services)
    : id_(std::move(id)), services_(services), plateName_(document.platePath), posted_(document.posted),
      settings_(document.settings), lastUsed_(std::chrono::steady_clock::now()),
      renderer_(std::make_unique<SessionRenderer>(services.device, services.cacheFolder))
{
    if (posted_) {
        checkPixels(posted_->width, posted_->height, 1);
        scratch_ = std::make_unique<ScratchFolder>();
        services_.folder.resolve(settings_);
        return;
    }
    const std::lock_guard lock(inputsMutex_);
    shelfFor(services_.folder.resolve(settings_), plateName());
}

Session::~Session()
{
    services_.queue->run([this] { renderer_.reset(); });
}

void Session::count(int requests)
{
    const std::lock_guard lock(mutex_);
    busy_ += requests;
    lastUsed_ = std::chrono::steady_clock::now();
}

bool Session::isIdle() const
{
    const std::lock_guard lock(mutex_);
    return busy_ == 0 && std::chrono::steady_clock::now() - lastUsed_ > services_.limits.idle;
}

shot::Settings Session::settings() const
{
    const std::lock_guard lock(mutex_);
    return settings_;
}

void Session::change(std::string_view json)
{
    const std::lock_guard oneByOne(changeMutex_);
    shot::Settings changed = settings();
    changeSettings(changed, json);
    services_.folder.resolve(changed);
    const Use use(*this);
    const std::lock_guard lock(mutex_);
    settings_ = changed;
}

void Session::checkPixels(int width, int height, double scale) const
{
    const double megapixels = 1e-6 * width * scale * height * scale;
    if (megapixels > services_.limits.megapixels)
        throw Refusal(413, "too-many-pixels", "{}x{} pixels: at most {:g} million of them are rendered at once",
                      std::lround(width * scale), std::lround(height * scale), services_.limits.megapixels);
}

std::string Session::plateName() const
{
    if (!posted_) return services_.folder.resolve(plateName_, "plate");
    if (postedEnding_.empty()) throw Refusal(404, "no-plate", "no plate was posted yet");
    return scratch_->path() + "/plate.%08d" + postedEnding_;
}

/// inputsMutex_ is held.
std::shared_ptr<PlateShelf> Session::shelfFor(const shot::Settings& settings, const std::string& path)
{
    std::string key =
        ServedFolder::stampOf(io::isFramePattern(path) ? std::filesystem::path(path).parent_path().string() : path, 0);
    for (const char* name :
         {"colorspace", "ocio", "fps", "first-frame", "on-error", "stream", "layer", "view", "deinterlace"})
        key += shot::toText(settings, shot::findParameter(name)) + "|";
    if (shelf_ && key == shelfKey_) return shelf_;
    const io::ReadOptions options = shot::readOptionsOf(settings, shot::onErrorOf(settings));
    auto shelf = std::make_shared<PlateShelf>(path, options, services_.limits.cacheBytes / 4);
    const io::PlateInfo& info = shelf->info();
    checkPixels(info.width, info.height, 1);
    if (posted_ && (info.width != posted_->width || info.height != posted_->height))
        throw Refusal(422, "input", "the plates posted are {}x{}; the session's are {}x{}", info.width, info.height,
                      posted_->width, posted_->height);
    shelf_ = shelf;
    shelfKey_ = key;
    return shelf;
}

/// inputsMutex_ is held.
std::shared_ptr<const RenderInputs> Session::inputsFor(const shot::Settings& settings, const std::string& fileStamps,
                                                       bool layers)
{
    const bool isLit = shot::planFrame(settings, {.layers = layers}, false).features.light();
    const bool needsSamples = (isLit && settings.env.empty() && settings.envFrames > 0) || !settings.gradeFrom.empty();
    // Plates that are posted one by one change the shelf, but nothing of the shot unless it is judged by them.
    std::string key = fmt::format("{}|{}|{}|{}|", fileStamps, isLit, needsSamples, settings.env.empty());
    if (!posted_ || needsSamples) key += shelfKey_;
    for (const shot::Parameter& p : shot::parameters())
        if (goesIntoInputs(p.name)) key += shot::toText(settings, p) + "|";
    std::shared_ptr<const RenderInputs>& kept = inputs_[layers ? 1 : 0];
    if (kept && kept->key == key) return kept;
    const io::PlateInfo& plate = shelf_->info();
    auto made = std::make_shared<RenderInputs>();
    made->key = key;
    made->shot = {plate.width, plate.height, settings.fps.value_or(plate.fps), plate.frames.front()};
    if (!shot::planFrame(settings, {}, false).isPassThrough()) made->shot.track = shot::shotTrack(settings, plate);
    if (needsSamples) made->samples = shelf_->samples(settings, isLit, made->shot.track.isStatic());
    return kept = made;
}

void Session::putPlate(FrameNumber frame, std::string_view type, std::string_view body)
{
    const Use use(*this);
    if (!posted_) throw Refusal(409, "plate-by-path", "this session's plate is '{}'; it takes no others", plateName_);
    if (frame < 0 || frame > 99'999'999)
        throw Refusal(400, "invalid-argument", "frame {}: plates that are posted have numbers 0 to 99999999", frame);
    const std::string_view kind = type.substr(0, type.find(';'));
    const std::string ending = kind == rawType || kind == "image/x-exr" ? ".exr"
                               : kind == "image/png"                    ? ".png"
                               : kind == "image/jpeg"                   ? ".jpg"
                                                                        : "";
    if (ending.empty())
        throw Refusal(415, "content-type", "'{}': a plate is {}, image/x-exr, image/png or image/jpeg", shortened(kind),
                      rawType);
    const std::lock_guard lock(inputsMutex_);
    if (!postedEnding_.empty() && ending != postedEnding_)
        throw Refusal(415, "content-type", "the session's plates are {} files; {} ones do not go with them",
                      postedEnding_, ending);
    std::size_t bytes = body.size();
    for (const auto& [number, size] : postedBytes_) bytes += number != frame ? size : 0;
    if (bytes > services_.limits.plateBytes)
        throw Refusal(413, "too-many-plates", "the session's plates come to {} bytes; at most {}", bytes,
                      services_.limits.plateBytes);
    const std::string incoming = scratch_->path() + "/incoming" + ending;
    int width = 0, height = 0;
    if (kind == rawType) {
        const RawHeader header = parseRawHeader(body);
        width = header.frameWidth, height = header.frameHeight;
        if (width == posted_->width && height == posted_->height)
            io::writeExr(incoming, readRaw(body), {"R", "G", "B", "A"}, !header.isFloat, "none");
    } else {
        io::writeWholeFile(incoming, body);
        const io::ImageHeader header = io::readPictureHeader(incoming);
        width = header.width, height = header.height;
    }
    if (width != posted_->width || height != posted_->height)
        throw Refusal(422, "input", "frame {} is {}x{}; the session's plates are {}x{}", frame, width, height,
                      posted_->width, posted_->height);
    const std::string path = io::framePath(scratch_->path() + "/plate.%08d" + ending, frame);
    if (std::rename(incoming.c_str(), path.c_str()) != 0)
        throw Error(ErrorCode::Output, "frame {}: cannot be kept", frame);
    postedEnding_ = ending;
    postedBytes_[frame] = body.size();
}

nlohmann::json Session::summary() const
{
    return {{"id", id_}, {"plate", posted_ ? nlohmann::json() : nlohmann::json(plateName_)}};
}

nlohmann::json Session::describe()
{
    using nlohmann::json;
    const Use use(*this);
    const shot::Settings now = settings();
    json values = json::object();
    for (const shot::Parameter& p : shot::parameters()) values[p.name] = shot::toJson(now, p);
    json plate = {{"path", posted_ ? json() : json(plateName_)}};
    if (posted_) plate.update({{"width", posted_->width}, {"height", posted_->height}});
    std::shared_ptr<PlateShelf> shelf;
    {
        const std::lock_guard lock(inputsMutex_);
        if (!posted_ || !postedEnding_.empty()) shelf = shelfFor(services_.folder.resolve(now), plateName());
    }
    if (shelf) {
        const io::PlateInfo& info = shelf->info();
        plate.update({{"width", info.width},
                      {"height", info.height},
                      {"fps", info.fps},
                      {"frames", formatFrameRange(info.frames)},
                      {"first", info.frames.front()},
                      {"last", info.frames.back()},
                      {"is_still", info.isStill},
                      {"format", info.format},
                      {"colorspace", info.colorspace},
                      {"working_colorspace", info.workingColorspace}});
    }
    return {{"id", id_}, {"plate", plate}, {"settings", values}, {"idle_seconds", services_.limits.idle.count()}};
}

}  // namespace virga::server
