#include "shot/Doubts.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "core/Log.h"
#include "shot/DepthSource.h"
#include "shot/FrameChoice.h"

namespace virga::shot {
namespace {

using Findings = std::vector<Finding>;

double median(std::vector<float> values)
{
    if (values.empty()) return 0;
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

/// Median of the finite depths in a quarter of the rows, from the top or the bottom.
double medianOfQuarter(ConstImageViewF metres, bool bottom)
{
    const int rows = std::max(1, metres.height() / 4), first = bottom ? metres.height() - rows : 0;
    std::vector<float> values;
    for (int y = first; y < first + rows; ++y)
        for (int x = 0; x < metres.width(); ++x)
            if (std::isfinite(metres.at(x, y))) values.push_back(metres.at(x, y));
    return median(std::move(values));
}

/// The file's own units are taken for metres.
bool isUnscaled(const Settings& s)
{
    return s.depthScale == 1 && s.depthOffset == 0 && !s.depthInvert &&
           (s.depthKind == "z" || s.depthKind == "distance") && s.depthRange == Settings().depthRange;
}

/// Largest finite value, and whether all of them are whole numbers.
struct StoredValues {
    float largest = 0;
    bool areWhole = true;
};

StoredValues storedValues(ConstImageViewF stored)
{
    StoredValues found;
    for (int y = 0; y < stored.height(); ++y)
        for (int x = 0; x < stored.width(); ++x) {
            const float value = stored.at(x, y);
            if (!std::isfinite(value)) continue;
            found.largest = std::max(found.largest, value);
            found.areWhole = found.areWhole && value == std::round(value);
        }
    return found;
}

/// Which way the file's up points, by the mean of the cameras' own up: a camera is seldom upside down.
Findings upDoubts(const camera::Track& track)
{
    glm::dvec3 up(0);
    for (const auto& [frame, pose] : track.poses()) up += pose.worldFromCamera[1];
    up /= double(track.poses().size());
    constexpr double clearly = 0.7;
    if (up.y < -clearly)
        return {
            {Severity::Warning, "camera", "the camera is upside down: up in the file is perhaps -y", "--camera-up=-y"}};
    if (std::abs(up.y) < 0.5 && std::abs(up.z) > clearly)
        return {{Severity::Warning, "camera",
                 "the camera looks straight up or down: up in the file is perhaps z, not y",
                 up.z > 0 ? "--camera-up z" : "--camera-up=-z"}};
    if (std::abs(up.y) < 0.5 && std::abs(up.x) > clearly)
        return {{Severity::Warning, "camera", "the camera lies on its side, and so will the rain", ""}};
    return {};
}

Findings jumpDoubts(const camera::Track& track, double fps)
{
    constexpr double fastest_m_s = 150;  // racing cars and airliners at take-off are slower
    double fastest = 0, longest = 0;
    FrameNumber at = 0;
    const auto& poses = track.poses();
    for (auto next = poses.begin(), pose = next++; next != poses.end(); pose = next++) {
        const double frames = double(next->first - pose->first);
        const double step = glm::distance(next->second.position, pose->second.position) / frames;
        if (step * fps > fastest) fastest = step * fps, longest = step, at = pose->first;
    }
    if (!(fastest > fastest_m_s)) return {};
    return {{Severity::Warning, "camera",
             fmt::format("after frame {} the camera moves {:.4g} m a frame, {:.4g} m/s: are the units centimetres?", at,
                         longest, fastest),
             "--camera-scale 0.01"}};
}

Findings rangeDoubts(const camera::Track& track, const std::vector<FrameNumber>& frames)
{
    const auto [first, last] = std::minmax_element(frames.begin(), frames.end());
    const FrameNumber begin = track.firstFrame(), end = track.lastFrame();
    if (track.poses().size() == 1 || (begin <= *first && *last <= end)) return {};
    const std::string poses = fmt::format("the track has poses for {}-{}", begin, end);
    if (end < *first || begin > *last)
        return {{Severity::Warning, "camera",
                 fmt::format("{}, but the frames are {}-{}: the camera would stand still", poses, *first, *last),
                 fmt::format("--camera-offset {}", *first - begin)}};
    std::vector<FrameNumber> held;
    std::copy_if(frames.begin(), frames.end(), std::back_inserter(held),
                 [&](FrameNumber frame) { return frame < begin || frame > end; });
    std::sort(held.begin(), held.end());
    return {{Severity::Warning, "camera",
             fmt::format("{}; {} outside, where the camera stands still", poses, describeFrames(held, "is", "are")),
             ""}};
}

Findings groundDoubts(const camera::Track& track, const std::vector<FrameNumber>& frames, const Settings& settings)
{
    if (settings.ground.empty() || !settings.depth.empty()) return {};
    const double level = track.at(double(frames.front())).position.y - parseGround(settings.ground).height_m;
    for (const FrameNumber frame : frames)
        if (const double height = track.at(double(frame)).position.y - level; !(height > 0))
            return {{Severity::Error, "camera",
                     fmt::format("in frame {} the camera track is {:g} m under the ground", frame, -height),
                     "--ground"}};
    return {};
}

void append(Findings& all, Findings some) { all.insert(all.end(), some.begin(), some.end()); }

}  // namespace

void warnOf(const std::vector<Finding>& findings)
{
    for (const Finding& finding : findings)
        if (finding.severity == Severity::Warning)
            log::warning("{}: {}{}", finding.input, finding.sentence,
                         finding.flag.empty() ? "" : fmt::format(" ({})", finding.flag));
}

Findings plateDoubts(const io::PlateInfo& plate, bool saysRate)
{
    Findings found;
    const bool isGuess = plate.colorspaceSource.starts_with("guess");
    found.push_back({isGuess ? Severity::Note : Severity::Ok, "plate",
                     fmt::format("its colours are {} ({})", plate.colorspace, plate.colorspaceSource),
                     isGuess ? "--colorspace" : ""});
    // FFmpeg, for one, writes "linear" into every DPX; nobody keeps linear light in so few bits.
    if (!plate.isMovie && !plate.isFloat && plate.bitDepth <= 12 && plate.colorspace.starts_with("Linear"))
        found.push_back(
            {Severity::Warning, "plate",
             fmt::format("linear light in {} bits is unlikely: most programs mean video or log codes", plate.bitDepth),
             "--colorspace"});
    if (!saysRate && !plate.isStill)
        found.push_back({Severity::Note, "plate",
                         fmt::format("it does not say its frame rate; {:g} frames a second are taken", plate.fps),
                         "--fps"});
    if (plate.fps < 5 || plate.fps > 1000)
        found.push_back(
            {Severity::Warning, "plate", fmt::format("{:g} frames a second are unusual", plate.fps), "--fps"});
    if (plate.isVariableRate)
        found.push_back(
            {Severity::Note, "plate",
             fmt::format("its frame rate varies, {:.4g} a second on average; rain falls at that rate", plate.fps), ""});
    if (std::abs(plate.pixelAspect - 1) > 1e-3)
        found.push_back({Severity::Warning, "plate",
                         fmt::format("its pixels are {:.4g} times as wide as high, and rain is drawn for square ones",
                                     plate.pixelAspect),
                         ""});
    if (io::isInterlaced(plate.scan) && !plate.isDeinterlaced)
        found.push_back({Severity::Warning, "plate",
                         fmt::format("it is {}, and rain is drawn for whole frames", io::scanWords(plate.scan)),
                         "--deinterlace"});
    return found;
}

Findings trackDoubts(const camera::Track& track, const std::vector<FrameNumber>& frames, double fps,
                     const Settings& settings)
{
    Findings found;
    if (track.empty() || frames.empty()) return found;
    append(found, rangeDoubts(track, frames));
    append(found, jumpDoubts(track, fps));
    append(found, upDoubts(track));
    append(found, groundDoubts(track, frames, settings));
    return found;
}

Findings depthDoubts(const DepthSample& sample, const Settings& settings)
{
    const depth::DepthStatistics metres = depth::depthStatistics(sample.metres.metres);
    const depth::DepthCounts& counts = sample.metres.counts;
    const StoredValues stored = storedValues(sample.stored);
    const auto warning = [](const std::string& sentence, const char* flag) {
        return Finding{Severity::Warning, "depth", sentence, flag};
    };
    Findings found;
    if (counts.filled > counts.pixels / 2)
        found.push_back(warning(fmt::format("{:.0f} % of its pixels have no depth and take their neighbours'",
                                            100.0 * double(counts.filled) / double(counts.pixels)),
                                "--depth-no-value"));
    if (metres.finite == 0) {
        found.push_back(warning("all of it is sky", "--depth-scale"));
        return found;
    }
    const bool isUnscaledHere = isUnscaled(settings);
    constexpr double farthestMedian_m = 1000, nearestMedian_m = 0.05;
    if (isUnscaledHere && sample.full == 255)
        found.push_back(warning(
            fmt::format("codes of 8 bits, up to {:g}, are taken for metres: is it a normalised map?", stored.largest),
            "--depth-range NEAR,FAR"));
    else if (isUnscaledHere && sample.full == 1 && stored.largest <= 1)
        found.push_back(warning(fmt::format("no depth is over {:g} m: is it a normalised map, 0 to 1?", stored.largest),
                                "--depth-range NEAR,FAR"));
    else if (isUnscaledHere && sample.full == 1 && stored.areWhole && stored.largest <= 255 && stored.largest > 100)
        found.push_back(warning(
            fmt::format("whole numbers up to {:g} are taken for metres: are they codes of 8 bits?", stored.largest),
            "--depth-range NEAR,FAR"));
    else if (isUnscaledHere && sample.full > 255 && stored.largest > 0.999 * sample.full)
        found.push_back(warning(
            fmt::format("codes up to {:g} are taken for metres: is it a normalised map, or millimetres with {:g} for "
                        "no value?",
                        stored.largest, stored.largest),
            "--depth-range NEAR,FAR or --depth-scale 0.001"));
    else if (metres.median > farthestMedian_m)
        found.push_back(
            warning(fmt::format("half of it is farther than {:.4g} m: are the units millimetres?", metres.median),
                    "--depth-scale 0.001"));
    else if (metres.median < nearestMedian_m)
        found.push_back(warning(fmt::format("half of it is nearer than {:.2g} m: are the units right?", metres.median),
                                "--depth-scale"));
    const double above = medianOfQuarter(sample.metres.metres, false),
                 below = medianOfQuarter(sample.metres.metres, true);
    if (above > 0 && below > 3 * above)
        found.push_back(
            {Severity::Note, "depth",
             fmt::format("the lower rows are farther ({:.3g} m) than the upper ({:.3g} m): inverse depth, or white "
                         "for near?",
                         below, above),
             "--depth-kind inverse"});
    return found;
}

Findings depthSizeDoubts(int width, int height, const io::PlateInfo& plate)
{
    if (width == plate.width && height == plate.height) return {};
    const double shape = double(width) / height, plates = double(plate.width) / plate.height;
    const std::string sizes = fmt::format("is {}x{}, the plate {}x{}", width, height, plate.width, plate.height);
    // Half a pixel of the smaller one is what rounding a scaled size may give.
    const double rounding = 0.5 / std::min({width, height, plate.width, plate.height});
    if (std::abs(shape / plates - 1) > std::max(0.01, 2 * rounding))
        return {{Severity::Warning, "depth", sizes + ", another shape: it would be stretched over the plate", ""}};
    return {{Severity::Note, "depth", sizes + "; it is resampled with its edges kept", ""}};
}

Finding panoramaDoubt(int width, int height, bool isFloat)
{
    const double shape = double(width) / height;
    const auto is = [&](double other) { return std::abs(shape / other - 1) < 0.05; };
    const std::string size = fmt::format("is {}x{}", width, height);
    if (width == 1 && height == 1) return {Severity::Ok, "env", size + ": light from everywhere alike", ""};
    if (!is(2) && (is(4.0 / 3) || is(0.75) || is(6) || is(1.0 / 6)))
        return {Severity::Note, "env", size + ", not twice as wide as high: a cube map, by its shape", ""};
    if (!is(2) && shape < 2)
        return {Severity::Error, "env",
                size +
                    ", not twice as wide as high as a panorama of the whole sphere; virga env "
                    "makes one of other pictures",
                ""};
    if (!is(2)) return {Severity::Note, "env", size + ": a band around the horizon, which is filled up and down", ""};
    if (!isFloat)
        return {Severity::Warning, "env", size + " of low range: lights are cut off at white and only guessed",
                "--light-radiance"};
    return {Severity::Ok, "env", size + ", a whole sphere", ""};
}

}  // namespace virga::shot
