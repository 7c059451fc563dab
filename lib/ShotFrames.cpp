// Frames of a shot: the compositor that is made ready for a request, and what goes through it.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include "Pixels.h"
#include "Shot.h"
#include "core/Counters.h"
#include "core/Error.h"
#include "core/KeptFiles.h"
#include "shot/FramePlan.h"

namespace virga::lib {
namespace {

bool isSame(const ImageF& a, const ImageF& b)
{
    return a.width() == b.width() && a.height() == b.height() &&
           std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

[[noreturn]] void throwCancelled(const FrameRequest& request)
{
    throw Error(ErrorCode::Interrupted, "frame {}: cancelled", request.number);
}

/// `part` is of the frame and contains `region`.
ConstImageViewF cropOf(const ImageF& pixels, const Window& part, const Window& region)
{
    return {pixels.pixel(region.x - part.x, region.y - part.y), region.width, region.height, 4,
            std::ptrdiff_t(4) * pixels.width()};
}

ImageF layerOf(const io::RenderedFrame& rendered, const char* name, const Window& region)
{
    for (const io::Layer& layer : rendered.layers)
        if (layer.name == name && layer.channels.size() == 4) return layer.pixels;
    return ImageF(region.width, region.height, 4);  // nothing of it in the picture
}

}  // namespace

/// Puts a call among those that cancel() finds, while it lives.
class Shot::CallSpan {
public:
    explicit CallSpan(Shot& shot) : shot_(shot)
    {
        const std::lock_guard lock(shot_.callsMutex_);
        place_ = shot_.calls_.insert(shot_.calls_.end(), std::make_shared<Call>());
    }
    ~CallSpan()
    {
        const std::lock_guard lock(shot_.callsMutex_);
        shot_.calls_.erase(place_);
    }
    CallSpan(const CallSpan&) = delete;
    CallSpan& operator=(const CallSpan&) = delete;
    Call& call() const { return **place_; }

private:
    Shot& shot_;
    std::list<std::shared_ptr<Call>>::iterator place_;
};

void Shot::cancel() noexcept
{
    const std::lock_guard lock(callsMutex_);
    for (const auto& call : calls_) {
        call->isCancelled = true;
        if (call->ticket) call->ticket->cancel();
    }
}

void Shot::onQueue(Call& call, int priority, const std::function<void()>& work)
{
    shot::RenderQueue::Ticket ticket = queue_->submit(priority, [&work](const auto&) { work(); });
    {
        const std::lock_guard lock(callsMutex_);
        call.ticket = ticket;
        if (call.isCancelled) ticket.cancel();
    }
    ticket.wait();
}

// ---- The compositor -------------------------------------------------------------------------------------------------

Shot::Made Shot::wanted(const FrameRequest& request) const
{
    Made made{.settings = settingsCount_,
              .samples = samplesCount_,
              .hasDepth = request.depth.has_value(),
              // Once asked for, kept: hosts ask for the same again.
              .hasLayers = request.wantsLayers() || (compositor_ && made_.hasLayers),
              .device = fallback_.empty() ? device_ : "cpu",
              .panorama = panorama_,
              .fps = settings_.fps.value_or(fps_),
              .firstFrame = FrameNumber(settings_.firstFrame.value_or(0))};
    chooseSamples(made);
    return made;
}

void Shot::open(const Made& made)
{
    const shot::Settings settings = settingsFor(made);
    shot::Shot shot{width_, height_, made.fps, made.firstFrame};
    shot.inMemory = inMemory_;
    shot::CompositorOptions options;
    options.wanted.layers = made.hasLayers;
    options.changes = true;
    options.device = made.device;
    options.cacheFolder = keptFilesFolder();
    compositor_ = nullptr;  // before the next one, which needs the memory
    compositor_ = std::make_unique<shot::Compositor>(settings, shot, options, plateSamples(made));
}

void Shot::makeReady(const Made& made)
{
    if (compositor_ && made == made_) return;
    if (!settings_.gradeFrom.empty() && settings_.gradeAmount > 0 && made.graded.empty())
        throw Error(ErrorCode::InvalidArgument,
                    "grade-from '{}': needs frames of the plate to compare with, given after it is set "
                    "(virga_shot_add_plate_sample)",
                    settings_.gradeFrom);
    Made changed = made_;
    changed.settings = made.settings, changed.hasDepth = made.hasDepth, changed.panorama = made.panorama;
    if (compositor_ && changed == made)
        compositor_->change(settingsFor(made));
    else
        open(made);
    made_ = made;
}

/// A device that is not there, or that is lost while it draws, is replaced by the processor.
void Shot::withFallback(const FrameRequest& request, const std::function<void()>& work)
{
    try {
        makeReady(wanted(request));
        work();
    } catch (const Error& error) {
        if (error.code() != ErrorCode::Graphics || !fallback_.empty() || device_ == "cpu") throw;
        fallback_ = error.what();
        makeReady(wanted(request));
        work();
    }
}

// ---- Frames ---------------------------------------------------------------------------------------------------------

void Shot::takeDepth(const FrameRequest& request)
{
    if (!request.depth) return;
    const Picture& picture = *request.depth;
    shot::StoredDepth stored;
    stored.values = readStored(picture);
    if (picture.isInteger()) stored.full = double(picture.largestCode());
    if (picture.samples() == VIRGA_HALF) stored.sky = 65504;
    if (picture.samples() == VIRGA_FLOAT) stored.sky = 1e10;
    const shot::StoredDepth& last = inMemory_->depth;
    if (isSame(stored.values, last.values) && stored.full == last.full && stored.sky == last.sky) return;
    inMemory_->depth = std::move(stored);
    ++inMemory_->depthContent;
}

void Shot::prepare(const FrameRequest& request, Call& call)
{
    takeDepth(request);
    if (compositor_ && wanted(request) == made_) return;
    onQueue(call, request.priority, [&] { withFallback(request, [] {}); });
}

Window Shot::neededPlate(const FrameRequest& request) const
{
    Window needed = compositor_->plateNeededFor(request.view({}));
    if (needed.isEmpty()) needed = request.region;
    return compositor_->needsWholePlate() ? united(needed, request.frame) : needed;
}

Window Shot::plateNeeded(const virga_request* given)
{
    const CallSpan span(*this);
    const std::lock_guard turn(turn_);
    const FrameRequest request(given, width_, height_, false);
    if (shot::planFrame(settings_, {}, false).isPassThrough()) return request.region;
    prepare(request, span.call());
    return neededPlate(request);
}

/// The part of the plate that is read: what the region needs, with the chroma around it.
Window Shot::plateFor(const FrameRequest& request, const Window& needed) const
{
    const Picture& plate = *request.plate;
    const Window& given = plate.window();
    if (!given.contains(needed))
        throw Error(ErrorCode::InvalidArgument,
                    "plate: its window of {} x {} at ({}, {}) does not hold what the region needs, {} x {} at ({}, {}) "
                    "(virga_shot_plate_needed)",
                    given.width, given.height, given.x, given.y, needed.width, needed.height, needed.x, needed.y);
    const int beside = interpolatesChroma(plate, request.beauty()) ? 2 : 0;
    const Window wide{needed.x - beside, needed.y - beside, needed.width + 2 * beside, needed.height + 2 * beside};
    return wholeChroma(plate, overlap(given, wide));
}

io::RenderedFrame Shot::draw(const FrameRequest& request, Call& call)
{
    const Picture& picture = *request.plate;
    const Window part = plateFor(request, neededPlate(request));
    const auto toLinear = colors_.toLinear(picture.colorspace(), picture.name());
    ImageF pixels = readPixels(picture, part, *toLinear, request.beauty());
    const auto goesOn = [&](double done) {
        return !call.isCancelled &&
               (request.progress == nullptr || request.progress(request.user, done) == VIRGA_CONTINUE);
    };
    io::RenderedFrame rendered;
    onQueue(call, request.priority, [&] {
        withFallback(request, [&] {
            if (!goesOn(0)) throwCancelled(request);
            io::PlateFrame plate;
            plate.number = request.number;
            plate.time_s = double(request.number) / made_.fps;
            // A second time after the device was lost.
            plate.pixels = pixels.empty() ? readPixels(picture, part, *toLinear, request.beauty()) : std::move(pixels);
            if (request.plateContent != 0)
                plate.content = contentHash(fmt::format("{} {} {} {} {} {}", request.plateContent, request.scale,
                                                        part.x, part.y, part.width, part.height));
            rendered = compositor_->render(std::move(plate), request.view(part), goesOn);
            ++counters().frames;
            if (!goesOn(1)) throwCancelled(request);
        });
    });
    return rendered;
}

void Shot::write(const FrameRequest& request, const io::RenderedFrame& rendered)
{
    const std::string working = colors_.working(request.plate->colorspace(), request.plate->name());
    for (const auto& [layer, output] : request.outputs) {
        const auto toCodes = colors_.toCodes(working, output.colorspace(), output.name());
        if (*layer == '\0')
            writePixels(rendered.beauty, request.region, output, *toCodes);
        else
            writePixels(layerOf(rendered, layer, request.region), request.region, output, *toCodes);
    }
}

/// The settings change nothing.
void Shot::copyPlate(const FrameRequest& request)
{
    const Picture& plate = *request.plate;
    const std::string working = colors_.working(plate.colorspace(), plate.name());
    const Window part = plateFor(request, request.region);
    const ImageF nothing(request.region.width, request.region.height, 4);
    for (const auto& [layer, output] : request.outputs) {
        const auto toCodes = colors_.toCodes(working, output.colorspace(), output.name());
        const bool isPlate = *layer == '\0' || std::strcmp(layer, "plate") == 0;
        if (!isPlate) {
            writePixels(nothing, request.region, output, *toCodes);
        } else if (output.isLike(plate)) {
            copyPixels(plate, output, request.region);
        } else {
            const ImageF pixels = readPixels(plate, part, *colors_.toLinear(plate.colorspace(), plate.name()), &output);
            writePixels(cropOf(pixels, part, request.region), request.region, output, *toCodes);
        }
    }
}

void Shot::render(const virga_request* given)
{
    const CallSpan span(*this);
    Call& call = span.call();
    const std::lock_guard turn(turn_);
    const FrameRequest request(given, width_, height_, true);
    if (call.isCancelled) throwCancelled(request);
    colors_.use(settings_.ocio);
    if (shot::planFrame(settings_, {}, false).isPassThrough()) return copyPlate(request);
    // Names that nobody knows are told before anything is drawn.
    for (const auto& [layer, output] : request.outputs)
        colors_.toCodes(colors_.working(request.plate->colorspace(), request.plate->name()), output.colorspace(),
                        output.name());
    prepare(request, call);
    const io::RenderedFrame rendered = draw(request, call);
    if (rendered.beauty.width() != request.region.width || rendered.beauty.height() != request.region.height)
        throw Error(ErrorCode::Internal, "frame {}: {} x {} pixels were drawn for a region of {} x {}", request.number,
                    rendered.beauty.width(), rendered.beauty.height(), request.region.width, request.region.height);
    write(request, rendered);
}

}  // namespace virga::lib
