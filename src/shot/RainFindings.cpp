#include "shot/RainFindings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/Log.h"
#include "core/Parallel.h"
#include "matte/RainEstimate.h"
#include "shot/EnvironmentColor.h"

namespace virga::shot {
namespace {

using nlohmann::json;

constexpr double degree = std::numbers::pi / 180.0;
constexpr std::size_t judgedFrames = 5;
constexpr std::size_t mostCounted = 100'000;      // strokes that the statistics are made of
constexpr std::size_t enoughStrokes = 2000;       // of one solution: their means are good to 2 %
constexpr std::size_t searchedAtOnce = 4;         // frames
constexpr double leastGain = 0.1, mostGain = 10;  // of the environment, for --match
constexpr double fewestClear = 1;
constexpr double clearScore = 0.3;  // of a stroke that counts when it is asked whether it rains
constexpr double clearly = 2.5;     // so many times more bright ones than dark ones: codecs and leaves make both alike
constexpr double denseMass = 10.0, leastMass = 1.0, denseCoherence = 0.3;
constexpr double acrossWidths = 2.5;  // of an atlas tile (CutAtlas.h)

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

void RainFindings::judge(std::span<const ImageF> frames, const matte::Extraction& found, const MatteModel& model,
                         bool areDelivered)
{
    if (job_.paper) return;
    const std::size_t count = std::min(judgedFrames, found.alphas.size());
    std::vector<std::size_t> which;
    for (std::size_t i = 0; i < count; ++i) which.push_back(i * found.alphas.size() / count);
    std::vector<ImageF> bright, dark;
    for (const std::size_t k : which) bright.push_back(model.toLinearAlpha(found.alphas[k], found.scene));
    const matte::RainStrokeOptions options = model.strokeOptions(found);
    const std::vector<matte::RainStroke> strokes = matte::findRainStrokes(bright, options);
    brightStrokes_ = clearStrokes(strokes);
    judged_.clear();
    if (areDelivered) {
        for (const std::size_t k : which) judged_[k];
        for (const matte::RainStroke& stroke : strokes) judged_[which[std::size_t(stroke.frame)]].push_back(stroke);
    }
    brightMass_ = massOf(bright);
    for (const ImageF& alpha : matte::alphasBelow(frames, which, found))
        dark.push_back(model.toLinearAlpha(alpha, found.scene));
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

/// Those first that were searched when it was judged whether it rains.
void RainFindings::gather(const matte::Extraction& found, const MatteModel& model, std::size_t from, std::size_t count)
{
    const matte::RainStrokeOptions options = model.strokeOptions(found);
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
}

void RainFindings::makeAtlas()
{
    if (best_.empty()) return;
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
}

void RainFindings::report(const io::PlateInfo& footage, const MatteModel& model, const ImageF& plate, json& rain,
                          json& match) const
{
    const std::vector<ImageF> sizes;  // rainStatistics asks the alphas for their area alone
    const matte::RainStatistics s = matte::rainStatistics(strokes_, sizes);
    const double megapixels = 1e-6 * footage.width * footage.height;
    const double perFrame = countedFrames_ > 0 ? double(s.count) / double(countedFrames_) : 0.0;
    rain["found"] = job_.paper ? json() : json(rains_);
    rain["strokes_bright"] = brightStrokes_;
    rain["strokes_dark"] = darkStrokes_;
    rain["mass_bright"] = brightMass_;
    rain["mass_dark"] = darkMass_;
    rain["strokes"] = s.count;
    rain["strokes_frames"] = countedFrames_;
    rain["strokes_per_frame"] = perFrame;
    rain["strokes_per_megapixel"] = perFrame / megapixels;
    rain["strokes_slant_deg"] = s.slant / degree;
    rain["slant_spread_deg"] = s.slantSpread / degree;
    rain["mean_length_px"] = s.meanLength;
    rain["median_length_px"] = s.medianLength;
    rain["mean_width_px"] = s.meanWidth;
    addEstimate(footage, model, plate, rain, match);
}

void RainFindings::addEstimate(const io::PlateInfo& footage, const MatteModel& model, const ImageF& plate, json& rain,
                               json& match) const
{
    rain["rate_mm_h"] = rain["exposure_s"] = json();
    if (countedFrames_ == 0) return;
    matte::RainEstimateOptions options;
    options.focal_px = 0.5 * footage.width / std::tan(0.5 * job_.fov_deg * degree);
    options.fps = footage.fps;
    options.minContrast = minContrast_;
    const matte::RainEstimate e =
        matte::estimateRain(strokes_, footage.width, footage.height, int(countedFrames_), options);
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
        const std::array<double, 3> light = environmentColor(plate, job_.fov_deg * degree);
        const std::array<float, 3>& color = model.linearColor();
        const double gain = (double(color[0]) + color[1] + color[2]) / std::max(light[0] + light[1] + light[2], 1e-9);
        match = {{"rate", e.rate_mm_h},
                 {"env-gain", std::clamp(gain, leastGain, mostGain)},
                 {"fog-color", {light[0], light[1], light[2]}},
                 {"exposure", job_.exposure_s.value_or(e.exposure_s)},
                 {"opacity", e.opacity},
                 {"wind", {e.wind_m_s, 0.0}}};
    }
    if (atlas_ && e.found) match["mattes"] = "atlas.exr";
}

}  // namespace virga::shot
