#include "shot/ExtractDelivery.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/Error.h"
#include "core/Log.h"
#include "core/Parallel.h"
#include "core/Timer.h"
#include "io/AtomicFile.h"
#include "io/ColorConversion.h"
#include "io/Writers.h"
#include "matte/AtlasSheet.h"
#include "matte/ExposureGain.h"
#include "shot/ExtractSheet.h"

namespace virga::shot {
namespace {

using nlohmann::json;

constexpr std::array outputs = {"alpha.####.exr", "confidence.####.exr", "clean.exr",
                                "confidence.exr", "atlas.exr",           "sheet.png"};
constexpr float wet = 0.05f;  // alpha, for the share of the picture that it rains in
constexpr int sheetColumns = 16;

}  // namespace

/// One frame on its way out.
struct ExtractDelivery::Delivered {
    ImageF alpha;       // linear light
    ImageF confidence;  // if it is asked for
    ImageF clean;       // scene-linear RGBA
    std::size_t wetSamples = 0;

    /// This much of the frame's own, the rest of what another solution has of it.
    void fadeFrom(const Delivered& other, float own)
    {
        const auto mix = [own](ImageF& to, const ImageF& from) {
            for (std::size_t i = 0; i < from.size(); ++i)
                to.data()[i] = from.data()[i] + own * (to.data()[i] - from.data()[i]);
        };
        mix(alpha, other.alpha);
        mix(confidence, other.confidence);
        mix(clean, other.clean);
    }
};

ExtractDelivery::ExtractDelivery(const ExtractJobOptions& job, ExtractFootage& footage)
    : job_(job), footage_(footage), findings_(job)
{
    io::checkOutputFolder(path("alpha.exr"));
    const io::PlateInfo& info = footage.info();
    for (const char* name : outputs)
        for (const FrameNumber frame : info.frames) {
            const std::string from = io::isFramePattern(info.path) ? io::framePath(info.path, frame) : info.path;
            const std::string to = io::isFramePattern(name) ? io::framePath(path(name), frame) : path(name);
            if (io::isSameFile(to, from)) throw Error(ErrorCode::Output, "'{}': is the footage itself", to);
        }
    for (const char* name : outputs) io::sweepLeftovers(path(name));
    if (job.clean == "none") return;
    for (const char* name : outputs)
        if (io::framePath(job.clean, 0) == io::framePath(name, 0))
            throw Error(ErrorCode::Output, "--clean '{}': that name is taken by another of the results", job.clean);
    if (!io::isMovieName(job.clean) && !io::isFramePattern(job.clean) && footage.frames().size() > 1)
        throw Error(ErrorCode::Output, "--clean '{}': is one image, but there are {} frames; name a pattern or a movie",
                    job.clean, footage.frames().size());
    io::WriteOptions options;
    options.half = writesHalf();
    // As footage that is EXR has it; else what costs a third of the time of "zip" and a third more room.
    const bool isExr = std::filesystem::path(job.clean).extension() == ".exr";
    if (isExr && !footage.info().format.starts_with("openexr")) options.codec = "rle";
    clean_ = io::createPlateWriter(path(job.clean), footage.reader(), options);
}

ExtractDelivery::~ExtractDelivery() = default;

std::string ExtractDelivery::path(const std::string& name) const
{
    return (std::filesystem::path(job_.output) / name).string();
}

bool ExtractDelivery::writesHalf() const
{
    const io::PlateInfo& info = footage_.info();
    return job_.half || (!job_.floats && info.bitDepth <= (info.isFloat ? 16 : 10));
}

void ExtractDelivery::keepPlate(const matte::Extraction& found)
{
    plate_ = found.scene;
    confidence_ = matte::alphaConfidence(found, nullptr);
}

/// frame: without its gain.
ExtractDelivery::Delivered ExtractDelivery::prepare(ImageF frame, const ImageF* coverage, const Solution& solution,
                                                    std::size_t k) const
{
    const matte::Extraction& found = solution.found;
    const auto channels = std::size_t(footage_.channels());
    const std::span<const double> gains = std::span(found.gains).subspan(k * channels, channels);
    ImageF warpedAlpha, warpedScene, warpedTrust;
    const ImageF *inView = &found.alphas[k], *sceneInView = &found.scene;
    const ImageF* trust = found.trust.empty() ? nullptr : &found.trust[k];
    if (!solution.places.empty()) {
        const matte::Homography& place = solution.places[k].referenceFromFrame;
        warpedAlpha = matte::warpFromReference(*inView, place);
        for (float& value : warpedAlpha.values()) value = std::clamp(value, 0.0f, 1.0f);
        warpedScene = matte::warpFromReference(*sceneInView, place);
        if (trust != nullptr) warpedTrust = matte::warpFromReference(*trust, place);
        inView = &warpedAlpha;
        sceneInView = &warpedScene;
        if (trust != nullptr) trust = &warpedTrust;
    }
    if (!rains()) {
        warpedAlpha = ImageF(frame.width(), frame.height(), 1);
        inView = &warpedAlpha;
    }
    const ImageF &alpha = *inView, &scene = *sceneInView;

    Delivered out;
    out.alpha = job_.paper ? alpha : model_.toLinearAlpha(alpha, scene);
    if (job_.confidence) {
        matte::Extraction here;
        here.scene = scene;
        here.color = found.color;
        here.terms = found.terms;
        out.confidence = matte::alphaConfidence(here, trust);
    }
    matte::removeRain(frame, alpha, scene, trust, found.color);
    matte::applyGain(frame, gains);
    fromModel(frame, model_.space());
    out.clean = ImageF(frame.width(), frame.height(), 4, 1.0f);
    const float* from = frame.data();
    float* to = out.clean.data();
    const std::size_t green = channels == 3 ? 1 : 0, blue = 2 * green;
    for (std::size_t i = 0; i < alpha.size(); ++i, from += channels, to += 4) {
        to[0] = from[0];
        to[1] = from[green];
        to[2] = from[blue];
    }
    if (coverage != nullptr)
        for (std::size_t i = 0; i < alpha.size(); ++i) out.clean.data()[4 * i + 3] = coverage->data()[i];
    return out;
}

bool ExtractDelivery::deliver(const FootageWindow& window, Solution& solution, std::size_t from, std::size_t to,
                              const Solution* before, std::size_t fade, const std::function<bool(FrameNumber)>& tell)
{
    matte::Extraction& found = solution.found;
    const auto gainsOf = [channels = std::size_t(footage_.channels())](const Solution& of, std::size_t k) {
        return std::span(of.found.gains).subspan(k * channels, channels);
    };
    const auto ready = [&](std::size_t k) {
        const ImageF* coverage = window.coverages.empty() ? nullptr : &window.coverages[k];
        const FrameNumber number = window.numbers[k];
        const auto there =
            before != nullptr && k - from < fade
                ? std::find(before->numbers.begin(), before->numbers.end(), number) - before->numbers.begin()
                : std::ptrdiff_t(before != nullptr ? before->numbers.size() : 0);
        const bool isFading = before != nullptr && std::size_t(there) < before->numbers.size();
        // A solution without places has taken the gains out of its window's frames.
        ImageF frame = window.frames[k];
        Delivered earlier;
        if (isFading) {
            ImageF again = frame;
            if (solution.places.empty()) matte::applyGain(again, gainsOf(solution, k));
            matte::removeGain(again, gainsOf(*before, std::size_t(there)));
            earlier = prepare(std::move(again), coverage, *before, std::size_t(there));
        }
        if (!solution.places.empty()) matte::removeGain(frame, gainsOf(solution, k));
        Delivered out = prepare(std::move(frame), coverage, solution, k);
        if (isFading) out.fadeFrom(earlier, float((double(k - from) + 0.5) / double(fade)));
        for (const float value : out.alpha.values()) out.wetSamples += value > wet;
        return out;
    };
    bool goesOn = true;
    // A few frames at a time, so that the cores are busy and memory is bounded.
    constexpr std::size_t atOnce = 4;
    const std::size_t countBefore = delivered_.size();
    for (std::size_t begin = from; begin < to && goesOn; begin += atOnce) {
        const std::size_t end = std::min(to, begin + atOnce);
        std::vector<Delivered> out(end - begin);
        const Timer timer;
        parallelFor(0, std::ptrdiff_t(out.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (auto n = std::size_t(first); n < std::size_t(last); ++n) {
                out[n] = ready(begin + n);
                const FrameNumber number = window.numbers[begin + n];
                io::writeExr(io::framePath(path("alpha.####.exr"), number), out[n].alpha, {"A"}, writesHalf(), "rle");
                if (job_.confidence)
                    io::writeExr(io::framePath(path("confidence.####.exr"), number), out[n].confidence, {"confidence"},
                                 true, "rle");
            }
        });
        seconds_["clean"] += timer.seconds();
        const Timer writing;
        for (std::size_t n = 0; n < out.size() && goesOn; ++n) {
            const std::size_t k = begin + n;
            wetSamples_ += double(out[n].wetSamples);
            samples_ += double(out[n].alpha.size());
            if (delivered_.size() == footage_.frames().size() / 2) {
                sheetFrame_ = window.frames[k];
                fromModel(sheetFrame_, model_.space());
                sheetAlpha_ = out[n].alpha;
                sheetClean_ = out[n].clean;
            }
            if (clean_) clean_->write({window.numbers[k], std::move(out[n].clean), {}, window.extras[k]});
            found.alphas[k] = std::move(out[n].alpha);
            delivered_.push_back(window.numbers[k]);
            goesOn = tell(window.numbers[k]);
        }
        seconds_["write"] += writing.seconds();
    }
    if (!job_.paper && rains()) {
        const Timer timer;
        findings_.gather(found, model_, from, delivered_.size() - countBefore);
        seconds_["strokes"] += timer.seconds();
    }
    return goesOn;
}

void ExtractDelivery::writeAtlas() const
{
    const matte::StrokeAtlas* atlas = findings_.atlas();
    if (atlas == nullptr) {  // one of an earlier extraction is not this footage's
        std::error_code error;
        for (const char* name : {"atlas.exr", "atlas.json"}) std::filesystem::remove(path(name), error);
        return;
    }
    const int columns = std::min(sheetColumns, atlas->count());
    io::writeExr(path("atlas.exr"), matte::atlasSheet(*atlas, columns), {"A"}, false);
    io::writeWholeFile(path("atlas.json"), matte::atlasJson(*atlas, columns));
}

void ExtractDelivery::finish()
{
    const Timer timer;
    if (clean_) clean_->finish();
    ImageF plate = plate_;
    fromModel(plate, model_.space());
    linearPlate_ = ImageF(plate.width(), plate.height(), 3);
    const ImageF& rgb = linearPlate_;
    for (std::size_t i = 0; i < rgb.size(); ++i)
        linearPlate_.data()[i] = plate.channels() == 3 ? plate.data()[i] : plate.data()[i / 3];
    together(
        [&] {
            io::writeExr(path("clean.exr"), rgb, {"R", "G", "B"}, false, "rle");  // its noise leaves zip little to gain
            io::writeExr(path("confidence.exr"), confidence_, {"confidence"}, true);
        },
        [&] {
            findings_.makeAtlas();
            writeAtlas();
            if (!sheetFrame_.empty())
                io::writePng(path("sheet.png"),
                             extractSheet(sheetFrame_, sheetAlpha_, rgb, sheetClean_, findings_.atlas()),
                             *footage_.info().colors, footage_.info().workingColorspace);
        });
    seconds_["write"] += timer.seconds();
}

json ExtractDelivery::report() const
{
    const io::PlateInfo& info = footage_.info();
    const std::array<float, 3>& color = model_.linearColor();
    json rain = {{"color", {color[0], color[1], color[2]}}, {"wet_share", samples_ > 0 ? wetSamples_ / samples_ : 0.0}};
    json match;
    findings_.report(info, model_, linearPlate_, rain, match);
    json seconds = json::object();
    for (const auto& [name, value] : seconds_) seconds[name] = value;
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    json files = {{"alpha", "alpha.####.exr"}, {"plate", "clean.exr"}, {"confidence", "confidence.exr"}};
    if (job_.clean != "none") files["clean"] = job_.clean;
    const matte::StrokeAtlas* atlas = findings_.atlas();
    if (atlas != nullptr) files["atlas"] = "atlas.exr";
    if (!sheetFrame_.empty()) files["sheet"] = "sheet.png";
    return {
        {"format", "virga-extract-report"},
        {"version", 1},
        {"footage",
         {{"path", info.path},
          {"width", info.width},
          {"height", info.height},
          {"fps", info.fps},
          {"frames", delivered_.size()},
          {"frame_range", formatFrameRange(delivered_)},
          {"format", info.format},
          {"colorspace", info.colorspace},
          {"colorspace_source", info.colorspaceSource},
          {"working_colorspace", info.workingColorspace},
          {"ocio", info.colors->origin()}}},
        {"rain", std::move(rain)},
        {"atlas", atlas != nullptr
                      ? json{{"strokes", atlas->count()}, {"tile_width", atlas->width}, {"tile_height", atlas->height}}
                      : json()},
        {"match", std::move(match)},
        {"files", std::move(files)},
        {"repaired", {{"values", footage_.repairedValues()}, {"frames", footage_.repairedFrames()}}},
        {"seconds", std::move(seconds)},
        {"peak_memory_mb", double(usage.ru_maxrss) / 1024}};
}

void ExtractDelivery::writeReport(const json& report) const
{
    io::writeWholeFile(path("report.json"), report.dump(2, ' ', false, json::error_handler_t::replace) + "\n");
}

}  // namespace virga::shot
