#include "shot/ExtractDelivery.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>

#include "core/Error.h"
#include "core/Log.h"
#include "core/Parallel.h"
#include "core/Timer.h"
#include "io/AtomicFile.h"
#include "io/Writers.h"
#include "matte/AtlasSheet.h"
#include "matte/ExposureGain.h"
#include "matte/RainEstimate.h"
#include "shot/EnvironmentColor.h"
#include "shot/ExtractSheet.h"

namespace virga::shot {
namespace {

using nlohmann::json;

constexpr double degree = std::numbers::pi / 180.0;
constexpr std::array outputs = {"alpha.####.exr", "confidence.####.exr", "clean.exr",
                                "confidence.exr", "atlas.exr",           "sheet.png"};
constexpr std::size_t judgedFrames = 5;
constexpr double leastContrast = 0.01;            // of a stroke's alpha, unless the noise is less
constexpr std::size_t mostCounted = 100'000;      // strokes that the statistics are made of
constexpr std::size_t enoughStrokes = 2000;       // of one solution: their means are good to 2 %
constexpr std::size_t searchedAtOnce = 4;         // frames
constexpr double leastGain = 0.1, mostGain = 10;  // of the environment, for --match
constexpr double fewestClear = 1;
constexpr double clearScore = 0.3;  // of a stroke that counts when it is asked whether it rains
constexpr double clearly = 2.5;     // so many times more bright ones than dark ones: codecs and leaves make both alike
constexpr double denseMass = 10.0, leastMass = 1.0, denseCoherence = 0.3;
constexpr float wet = 0.05f;  // alpha, for the share of the picture that it rains in
constexpr int sheetColumns = 16;
constexpr double acrossWidths = 2.5;  // of an atlas tile (CutAtlas.h)

void writeText(const std::string& path, const std::string& text)
{
    io::checkOutputFolder(path);
    io::AtomicFile whole(path);
    std::ofstream file(whole.temporaryPath());
    file << text;
    file.close();
    if (!file) throw Error(ErrorCode::Output, "'{}': cannot be written", path);
    whole.commit();
}

double medianOf(std::vector<float> values)
{
    if (values.empty()) return 0.0;
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

int clearStrokes(std::span<const matte::RainStroke> strokes)
{
    return int(std::count_if(strokes.begin(), strokes.end(),
                             [](const matte::RainStroke& stroke) { return stroke.score > clearScore; }));
}

/// Their mean.
double massOf(std::span<const ImageF> alphas)
{
    double sum = 0.0, count = 0.0;
    for (const ImageF& alpha : alphas) {
        for (const float value : alpha.values()) sum += value;
        count += double(alpha.size());
    }
    return count > 0.0 ? sum / count : 0.0;
}

/// The first, the middle, the quarters and so on of `count` frames: any number from the begin is spread over all.
std::vector<std::size_t> spreadOrder(std::size_t count)
{
    std::vector<std::size_t> order;
    std::vector<bool> taken(count, false);
    for (std::size_t parts = 1; order.size() < count; parts *= 2)
        for (std::size_t i = 0; i < parts; ++i)
            if (const std::size_t k = i * count / parts; !taken[k]) {
                taken[k] = true;
                order.push_back(k);
            }
    return order;
}

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

ExtractDelivery::ExtractDelivery(const ExtractJobOptions& job, ExtractFootage& footage) : job_(job), footage_(footage)
{
    io::checkOutputFolder(path("alpha.exr"));
    const io::PlateInfo& info = footage.info();
    for (const char* name : outputs)
        for (const FrameNumber frame : info.frames) {
            const std::string from = io::isFramePattern(info.path) ? io::framePath(info.path, frame) : info.path;
            const std::string to = io::isFramePattern(name) ? io::framePath(path(name), frame) : path(name);
            if (io::isSameFile(to, from)) throw Error(ErrorCode::Output, "'{}': is the footage itself", to);
        }
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

void ExtractDelivery::setModel(ModelSpace space, const std::array<float, 3>& color, const std::array<float, 3>& shown)
{
    space_ = space;
    color_ = color;
    ImageF one(1, 1, 3);
    std::copy_n(shown.begin(), 3, one.data());
    isRecoloured_ = color != shown;
    fromModel(one, space);
    std::copy_n(one.data(), 3, linearColor_.begin());
}

void ExtractDelivery::keepPlate(const matte::Extraction& found)
{
    plate_ = found.scene;
    confidence_ = matte::alphaConfidence(found, nullptr);
}

/// The alpha that lays the shown C over linear light as the model lays its own over its own values; least squares over
/// the channels. Most alphas are 0, and stay: what is more than that is asked a row at a time.
ImageF ExtractDelivery::toLinearAlpha(const ImageF& alpha, const ImageF& scene) const
{
    if (space_ == ModelSpace::Linear && !isRecoloured_) return alpha;
    const int channels = scene.channels();
    ImageF linear(alpha.width(), alpha.height(), 1);
    parallelFor(0, alpha.height(), 32, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        std::vector<int> wet;
        for (int y = int(first); y < int(last); ++y) {
            wet.clear();
            for (int x = 0; x < alpha.width(); ++x)
                if (alpha.row(y)[x] > 0.0f) wet.push_back(x);
            if (wet.empty()) continue;
            ImageF mixed(int(wet.size()), 1, channels), ground(int(wet.size()), 1, channels);
            float *below = ground.data(), *above = mixed.data();
            for (const int x : wet) {
                const float *s = scene.pixel(x, y), a = alpha.row(y)[x];
                for (int j = 0; j < channels; ++j) {
                    *below++ = s[j];
                    *above++ = s[j] + a * (color_[std::size_t(j)] - s[j]);
                }
            }
            fromModel(ground, space_);
            fromModel(mixed, space_);
            below = ground.data();
            above = mixed.data();
            for (const int x : wet) {
                float pull = 0.0f, square = 0.0f;
                for (int j = 0; j < channels; ++j, ++below, ++above) {
                    const float gap = linearColor_[std::size_t(j)] - *below;
                    pull += gap * (*above - *below);
                    square += gap * gap;
                }
                linear.row(y)[x] = square > 0.0f ? std::clamp(pull / square, 0.0f, 1.0f) : 0.0f;
            }
        }
    });
    return linear;
}

/// The noise of a linear alpha is that of the footage over what an alpha of 1 changes, in the middle of the picture's
/// values; the solver has smoothed it along the rain over sqrt(2 mu) / |C - S|.
matte::RainStrokeOptions ExtractDelivery::strokeOptions(const matte::Extraction& found) const
{
    const int channels = found.scene.channels();
    const std::size_t pixels = found.scene.size() / std::size_t(channels), stride = pixels / 20'000 + 1;
    std::vector<float> contrasts, scales;
    ImageF ground(1, 1, channels), nudged(1, 1, channels);
    for (std::size_t i = 0; i < pixels; i += stride) {
        float square = 0.0f, linearSquare = 0.0f, step = 0.0f;
        constexpr float nudge = 0.02f;
        for (int j = 0; j < channels; ++j) {
            const float s = found.scene.data()[i * std::size_t(channels) + std::size_t(j)];
            ground.data()[j] = s;
            nudged.data()[j] = s + nudge * (color_[std::size_t(j)] - s);
            square += (color_[std::size_t(j)] - s) * (color_[std::size_t(j)] - s);
        }
        fromModel(ground, space_);
        fromModel(nudged, space_);
        for (int j = 0; j < channels; ++j) {
            const float gap = linearColor_[std::size_t(j)] - ground.data()[j];
            linearSquare += gap * gap;
            step += gap * (nudged.data()[j] - ground.data()[j]);
        }
        if (!(square > 0.0f && linearSquare > 0.0f)) continue;
        contrasts.push_back(std::sqrt(square));
        scales.push_back(step / linearSquare / nudge);
    }
    const double contrast = std::max(medianOf(std::move(contrasts)), 1e-9);
    matte::RainStrokeOptions options;
    options.slant = found.direction.slant;
    options.noise = found.noise.typical / contrast * medianOf(std::move(scales));
    options.noiseAlong = std::sqrt(2.0 * found.terms.mu) / contrast;
    options.minContrast = std::min(leastContrast, std::max(options.noise, 1e-6));
    return options;
}

void ExtractDelivery::judge(std::span<const ImageF> frames, const matte::Extraction& found, bool areDelivered)
{
    if (job_.paper) return;
    const std::size_t count = std::min(judgedFrames, found.alphas.size());
    std::vector<std::size_t> which;
    for (std::size_t i = 0; i < count; ++i) which.push_back(i * found.alphas.size() / count);
    std::vector<ImageF> bright, dark;
    for (const std::size_t k : which) bright.push_back(toLinearAlpha(found.alphas[k], found.scene));
    const matte::RainStrokeOptions options = strokeOptions(found);
    const std::vector<matte::RainStroke> strokes = matte::findRainStrokes(bright, options);
    brightStrokes_ = clearStrokes(strokes);
    judged_.clear();
    if (areDelivered) {
        for (const std::size_t k : which) judged_[k];
        for (const matte::RainStroke& stroke : strokes) judged_[which[std::size_t(stroke.frame)]].push_back(stroke);
    }
    brightMass_ = massOf(bright);
    for (const ImageF& alpha : matte::alphasBelow(frames, which, found))
        dark.push_back(toLinearAlpha(alpha, found.scene));
    darkStrokes_ = clearStrokes(matte::findRainStrokes(dark, options));
    darkMass_ = massOf(dark);
    const bool hasStrokes = brightStrokes_ > clearly * darkStrokes_ + 3 * std::sqrt(darkStrokes_ + 1.0) + fewestClear;
    // Where it rains so hard that strokes cannot be told from each other.
    const bool isDense = brightMass_ > denseMass * darkMass_ && brightMass_ > leastMass * options.noise &&
                         found.direction.coherence > denseCoherence;
    rains_ = hasStrokes || isDense;
    if (!rains_)
        log::warning("'{}': no rain found: {} strokes brighter than the scene, {} darker; the alphas are 0",
                     job_.footage, brightStrokes_, darkStrokes_);
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
    if (!rains_) {
        warpedAlpha = ImageF(frame.width(), frame.height(), 1);
        inView = &warpedAlpha;
    }
    const ImageF &alpha = *inView, &scene = *sceneInView;

    Delivered out;
    out.alpha = job_.paper ? alpha : toLinearAlpha(alpha, scene);
    if (job_.confidence) {
        matte::Extraction here;
        here.scene = scene;
        here.color = found.color;
        here.terms = found.terms;
        out.confidence = matte::alphaConfidence(here, trust);
    }
    matte::removeRain(frame, alpha, scene, trust, found.color);
    matte::applyGain(frame, gains);
    fromModel(frame, space_);
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
                fromModel(sheetFrame_, space_);
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
    if (!job_.paper && rains_) gather(found, from, delivered_.size() - countBefore);
    return goesOn;
}

/// Strokes for the statistics and the best of them for the atlas, of `count` of the alphas that were delivered: of as
/// many frames as it takes to find enough, those first that were searched when it was judged whether it rains.
void ExtractDelivery::gather(matte::Extraction& found, std::size_t from, std::size_t count)
{
    const Timer timer;
    const matte::RainStrokeOptions options = strokeOptions(found);
    std::vector<matte::RainStroke> strokes;  // their frames: numbers in the solution
    std::size_t searched = 0;
    const auto add = [&](std::size_t k, std::vector<matte::RainStroke> some) {
        for (matte::RainStroke& stroke : some) {
            stroke.frame = int(k);
            strokes.push_back(stroke);
        }
        ++searched;
    };
    for (const auto& [k, some] : judged_)
        if (k >= from && k - from < count) add(k, some);
    std::vector<std::size_t> order;
    for (const std::size_t n : spreadOrder(count))
        if (!judged_.contains(from + n)) order.push_back(from + n);
    for (std::size_t begin = 0; begin < order.size() && strokes.size() < enoughStrokes; begin += searchedAtOnce) {
        const std::size_t some = std::min(searchedAtOnce, order.size() - begin);
        std::vector<std::vector<matte::RainStroke>> of(some);
        parallelFor(0, std::ptrdiff_t(some), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (auto n = std::size_t(first); n < std::size_t(last); ++n)
                of[n] = matte::findRainStrokes(std::span(&found.alphas[order[begin + n]], 1), options);
        });
        for (std::size_t n = 0; n < some; ++n) add(order[begin + n], std::move(of[n]));
    }
    std::stable_sort(strokes.begin(), strokes.end(),
                     [](const matte::RainStroke& a, const matte::RainStroke& b) { return a.frame < b.frame; });
    minContrast_ = options.minContrast;
    if (strokes_.size() < mostCounted) {
        strokes_.insert(strokes_.end(), strokes.begin(), strokes.end());
        countedFrames_ += searched;
    }
    for (const matte::RainStroke& stroke : matte::bestStrokes(strokes, job_.strokes))
        best_.push_back(matte::keepStroke(found.alphas[std::size_t(stroke.frame)], stroke, acrossWidths));
    std::stable_sort(best_.begin(), best_.end(), [](const matte::KeptStroke& a, const matte::KeptStroke& b) {
        return a.stroke.score > b.stroke.score;
    });
    if (best_.size() > std::size_t(job_.strokes)) best_.resize(std::size_t(job_.strokes));
    seconds_["strokes"] += timer.seconds();
}

void ExtractDelivery::makeAtlas()
{
    if (!best_.empty()) {
        std::vector<ImageF> alphas;
        std::vector<matte::RainStroke> strokes;
        for (matte::KeptStroke& kept : best_) {
            kept.stroke.frame = int(alphas.size());
            alphas.push_back(std::move(kept.alpha));
            strokes.push_back(kept.stroke);
        }
        matte::CutAtlasOptions options;
        options.count = job_.strokes;
        options.width = job_.tileWidth;
        options.height = job_.tileHeight;
        options.acrossWidths = acrossWidths;
        options.exposure = float(job_.exposure_s.value_or(0.0));
        atlas_ = matte::atlasOf(alphas, strokes, options);
        const int columns = std::min(sheetColumns, atlas_->count());
        io::writeExr(path("atlas.exr"), matte::atlasSheet(*atlas_, columns), {"A"}, false);
        writeText(path("atlas.json"), matte::atlasJson(*atlas_, columns));
    } else {  // one of an earlier extraction is not this footage's
        std::error_code error;
        for (const char* name : {"atlas.exr", "atlas.json"}) std::filesystem::remove(path(name), error);
    }
}

void ExtractDelivery::finish()
{
    const Timer timer;
    if (clean_) clean_->finish();
    ImageF plate = plate_;
    fromModel(plate, space_);
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
            makeAtlas();
            if (!sheetFrame_.empty())
                io::writePng(path("sheet.png"),
                             extractSheet(sheetFrame_, sheetAlpha_, rgb, sheetClean_, atlas_ ? &*atlas_ : nullptr));
        });
    seconds_["write"] += timer.seconds();
}

/// What the strokes say of the rain: under "rain" with its uncertainty, under "match" as settings of `virga rain`.
void ExtractDelivery::addEstimate(json& rain, json& match) const
{
    rain["rate_mm_h"] = rain["exposure_s"] = json();
    if (countedFrames_ == 0) return;
    const io::PlateInfo& info = footage_.info();
    matte::RainEstimateOptions options;
    options.focal_px = 0.5 * info.width / std::tan(0.5 * job_.fov_deg * degree);
    options.fps = info.fps;
    options.minContrast = minContrast_;
    const matte::RainEstimate e = matte::estimateRain(strokes_, info.width, info.height, int(countedFrames_), options);
    if (e.found) {
        rain["rate_mm_h"] = e.rate_mm_h;
        rain["rate_range_mm_h"] = {e.rateLow, e.rateHigh};
        rain["exposure_s"] = e.exposure_s;
        rain["exposure_range_s"] = {e.exposureLow, e.exposureHigh};
        rain["opacity"] = e.opacity;
        rain["opacity_range"] = {e.opacityLow, e.opacityHigh};
        rain["opacity_measured"] = e.opacityMeasured;
        rain["wind_m_s"] = e.wind_m_s;
        rain["drop_diameter_mm"] = 1e3 * e.diameter_m;
        // Drops were found to return `color`; of the plate alone, whose sky is cut off, the renderer would make less.
        const std::array<double, 3> light = environmentColor(linearPlate_, job_.fov_deg * degree);
        const double gain = (double(linearColor_[0]) + linearColor_[1] + linearColor_[2]) /
                            std::max(light[0] + light[1] + light[2], 1e-9);
        match = {{"rate", e.rate_mm_h},
                 {"env-gain", std::clamp(gain, leastGain, mostGain)},
                 {"fog-color", {light[0], light[1], light[2]}},
                 {"exposure", job_.exposure_s.value_or(e.exposure_s)},
                 {"opacity", e.opacity},
                 {"wind", {e.wind_m_s, 0.0}}};
    }
    if (atlas_ && e.found) match["mattes"] = "atlas.exr";
}

json ExtractDelivery::report() const
{
    const io::PlateInfo& info = footage_.info();
    std::vector<ImageF> sizes;  // rainStatistics asks the alphas for their area alone
    matte::RainStatistics s = matte::rainStatistics(strokes_, sizes);
    const double megapixels = 1e-6 * info.width * info.height;
    const double perFrame = countedFrames_ > 0 ? double(s.count) / double(countedFrames_) : 0.0;
    json rain = {{"found", job_.paper ? json() : json(rains_)},
                 {"strokes_bright", brightStrokes_},
                 {"strokes_dark", darkStrokes_},
                 {"mass_bright", brightMass_},
                 {"mass_dark", darkMass_},
                 {"color", {linearColor_[0], linearColor_[1], linearColor_[2]}},
                 {"strokes", s.count},
                 {"strokes_frames", countedFrames_},
                 {"strokes_per_frame", perFrame},
                 {"strokes_per_megapixel", perFrame / megapixels},
                 {"strokes_slant_deg", s.slant / degree},
                 {"slant_spread_deg", s.slantSpread / degree},
                 {"mean_length_px", s.meanLength},
                 {"median_length_px", s.medianLength},
                 {"mean_width_px", s.meanWidth},
                 {"wet_share", samples_ > 0 ? wetSamples_ / samples_ : 0.0}};
    json match;
    addEstimate(rain, match);
    json seconds = json::object();
    for (const auto& [name, value] : seconds_) seconds[name] = value;
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    json files = {{"alpha", "alpha.####.exr"}, {"plate", "clean.exr"}, {"confidence", "confidence.exr"}};
    if (job_.clean != "none") files["clean"] = job_.clean;
    if (atlas_) files["atlas"] = "atlas.exr";
    if (!sheetFrame_.empty()) files["sheet"] = "sheet.png";
    return {{"format", "virga-extract-report"},
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
              {"colorspace_source", info.colorspaceSource}}},
            {"rain", std::move(rain)},
            {"atlas",
             atlas_ ? json{{"strokes", atlas_->count()}, {"tile_width", atlas_->width}, {"tile_height", atlas_->height}}
                    : json()},
            {"match", std::move(match)},
            {"files", std::move(files)},
            {"repaired", {{"values", footage_.repairedValues()}, {"frames", footage_.repairedFrames()}}},
            {"seconds", std::move(seconds)},
            {"peak_memory_mb", double(usage.ru_maxrss) / 1024}};
}

void ExtractDelivery::writeReport(const json& report) const
{
    writeText(path("report.json"), report.dump(2, ' ', false, json::error_handler_t::replace) + "\n");
}

}  // namespace virga::shot
