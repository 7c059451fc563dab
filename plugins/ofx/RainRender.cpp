// Rain::render: fetch what the frame needs, render it on a thread beside, and watch for the host's wish to stop.
#include <algorithm>
#include <chrono>
#include <future>
#include <memory>
#include <string_view>

#include "Rain.h"

namespace virga::ofxplugin {

using namespace std::chrono_literals;

namespace {

std::size_t hashOf(const virga_picture& picture, std::size_t pixelBytes)
{
    std::size_t hash = std::size_t(picture.window.width) * 31 + std::size_t(picture.window.height);
    for (int y = 0; y < picture.window.height; ++y) {
        const auto* row = static_cast<const char*>(picture.planes[0]) + std::ptrdiff_t(y) * picture.row_stride[0];
        const std::string_view bytes(row, pixelBytes * std::size_t(picture.window.width));
        hash = hash * 1099511628211u ^ std::hash<std::string_view>()(bytes);
    }
    return hash;
}

}  // namespace

struct Rain::Work {
    OfxTime time = 0;
    OfxRectI window{};
    Place place;
    std::vector<std::string> texts;
    std::vector<std::int64_t> wanted;  // as samples

    struct Sample {
        std::int64_t frame;
        std::size_t hash;
        FilledPicture filled;
    };
    std::vector<Sample> samples;  // fetched
    std::unique_ptr<Image> environment;
    std::string environmentId;
};

void Rain::fetchSamples(Work& work) const
{
    // Samples are whole frames at scale 1; a proxy's pixels stand for as many of the full picture as they cover.
    const OfxRectD region = work.place.canonical(work.place.whole());
    work.samples.clear();
    for (const std::int64_t frame : work.wanted) {
        const Image image(source_, double(frame), &region);
        if (image.isEmpty()) continue;
        FilledPicture filled(image, work.place.frame, work.place.whole());
        const std::size_t hash = hashOf(filled.picture(), image.pixelBytes());
        if (work.place.scale < 1) filled.stretch(work.place.width, work.place.height);
        work.samples.push_back({frame, hash, std::move(filled)});
        if (host().effect().abort(effect_) != 0) throw Abandoned();
    }
}

void Rain::fetchEnvironment(Work& work) const
{
    if (!isConnected(environment_)) return;
    const auto region = environment_->regionOfDefinition(work.time);
    if (!region) return;
    work.environment = std::make_unique<Image>(*environment_, work.time, &*region);
    if (work.environment->isEmpty()) throw Failure(ofx::statFailed, "the environment has no image at this time");
    const std::string id = work.environment->identifier();
    if (!id.empty()) work.environmentId = id + " " + std::to_string(work.place.scale);
}

OfxStatus Rain::render(const Properties& in)
{
    try {
        const auto window = in.rectangle(ofx::prop::renderWindow);
        if (!window) throw Failure(ofx::statFailed, "the host does not say what to render");
        Work work;
        work.time = in.number(ofx::prop::time, 0);
        work.window = *window;
        work.place = placeOf(work.time, scaleOf(in));
        work.texts = values_.texts(work.time);
        work.wanted = samplesWanted(work.texts);
        renderInto(work);
    } catch (const Abandoned&) {
        // The host has no use for the frame any more, nor for a message.
        framesMayDiffer_ = true;
    }
    return ofx::statOk;
}

void Rain::renderInto(Work& work)
{
    const Place& place = work.place;
    virga_request request = virga_request_default();
    request.frame = frameAt(work.time);
    request.scale = place.scale;
    request.region = place.frame.windowOf(work.window);  // beyond the frame it is overscan

    // What stands for the whole clip, and what of the plate this frame needs.
    bool needsSamples = false;
    withShot(place, work.texts, [&](SetShot& shot) {
        needsSamples = framesMayDiffer_.exchange(false) || shot.sampled.size() != work.wanted.size();
        for (const std::int64_t frame : work.wanted) needsSamples = needsSamples || !shot.sampled.contains(frame);
    });
    if (needsSamples) fetchSamples(work);
    fetchEnvironment(work);
    const auto giveLight = [&](SetShot& shot) {
        if (needsSamples) giveSamples(shot, work);
        giveEnvironment(shot, work);
    };
    virga_window needed = place.whole();
    withShot(place, work.texts, [&](SetShot& shot) {
        giveLight(shot);
        needs(virga_shot_plate_needed(shot.get(), &request, &needed));
    });

    const OfxRectD region = place.canonical(needed);
    const Image source(source_, work.time, &region);
    const Image output(output_, work.time, nullptr);
    if (output.isEmpty()) throw Failure(ofx::statFailed, "the host gave no image to render into");
    request.region = intersection(request.region, place.frame.windowOf(output.bounds()));
    if (request.region.width == 0) throw Failure(ofx::statFailed, "the host gave no pixels to render into");

    std::string plateSpace, outputSpace;
    const virga_window within = source.isEmpty() ? virga_window{} : source.picture(place.frame).window;
    std::optional<FilledPicture> filled;
    if (!contains(within, needed)) filled.emplace(source, place.frame, needed);
    virga_picture plate = filled ? filled->picture() : source.picture(place.frame);
    giveColour(plate, source_, work.time, plateSpace);
    virga_picture beauty = output.picture(place.frame);
    // The output means what the source does; a host without a word on either goes by each one's own depth.
    giveColour(beauty, source_, work.time, outputSpace);
    request.plate = &plate;
    const virga_picture** const results[] = {&request.beauty, &request.rain, &request.splash, &request.fog,
                                             &request.graded_plate};
    *results[std::clamp(values_.choice(control::output, work.time), 0, 4)] = &beauty;

    std::optional<Image> depthImage;
    std::optional<FilledPicture> depth;
    if (isConnected(depth_)) {
        const OfxRectD whole = place.canonical(place.whole());
        depthImage.emplace(*depth_, work.time, &whole);
        if (depthImage->isEmpty()) throw Failure(ofx::statFailed, "the depth has no image at this time");
        depth.emplace(*depthImage, place.frame, place.whole());
        request.depth = &depth->picture();
    }

    withShot(place, work.texts, [&](SetShot& shot) {
        giveLight(shot);
        // The library's sentence belongs to the thread that called it.
        std::string sentence;
        auto rendered = std::async(std::launch::async, [&] {
            const virga_error code = virga_shot_render(shot.get(), &request);
            if (code != VIRGA_OK) sentence = virga_error_sentence();
            return code;
        });
        while (rendered.wait_for(10ms) != std::future_status::ready)
            if (host().effect().abort(effect_) != 0) virga_shot_cancel(shot.get());
        const virga_error code = rendered.get();
        if (code == VIRGA_ERROR_CANCELLED) throw Abandoned();
        if (code != VIRGA_OK) throw Failure(ofx::statFailed, sentence);
    });
}

void Rain::giveSamples(SetShot& shot, const Work& work) const
{
    std::vector<std::int64_t> frames;
    for (const auto& sample : work.samples) frames.push_back(sample.frame);
    const bool hasOthers = std::any_of(shot.sampled.begin(), shot.sampled.end(), [&](const auto& had) {
        return std::find(frames.begin(), frames.end(), had.first) == frames.end();
    });
    if (hasOthers) {
        needs(virga_shot_clear_plate_samples(shot.get()));
        shot.sampled.clear();
    }
    for (const auto& sample : work.samples) {
        const auto had = shot.sampled.find(sample.frame);
        if (had != shot.sampled.end() && had->second == sample.hash) continue;
        virga_picture picture = sample.filled.picture();
        std::string space;
        giveColour(picture, source_, work.time, space);
        needs(virga_shot_add_plate_sample(shot.get(), sample.frame, &picture));
        shot.sampled[sample.frame] = sample.hash;
    }
}

void Rain::giveEnvironment(SetShot& shot, const Work& work) const
{
    if (!work.environment) {
        if (!shot.environment.empty()) needs(virga_shot_set_environment(shot.get(), nullptr));
        shot.environment.clear();
        return;
    }
    if (!work.environmentId.empty() && work.environmentId == shot.environment) return;
    const OfxRectI& bounds = work.environment->bounds();
    const FrameInPlane whole{bounds.x1, bounds.y1, bounds.x2 - bounds.x1, bounds.y2 - bounds.y1};
    virga_picture picture = work.environment->picture(whole);
    std::string space;
    giveColour(picture, *environment_, work.time, space);
    needs(virga_shot_set_environment(shot.get(), &picture));
    shot.environment = work.environmentId.empty() ? "?" : work.environmentId;
}

}  // namespace virga::ofxplugin
