// What the kernels of the CPU renderer share: a frame's constants and inputs, as pointers.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "core/Image.h"
#include "passes/Features.h"
#include "passes/SharedFrame.h"

namespace virga::passes::cpu {

/// As opticalDepthSteps of common_frame.glsl.
constexpr float opticalDepthSteps = 262144.0f;
/// Fainter strokes leave no depth or motion; as in strokes_splat.glsl.
constexpr float visibleInData = 1.0f / 1024;
/// Rows of a picture that one thread finishes, from the drops to the blend: their sums stay in its cache.
constexpr int bandRows = 32;

/// The mattes as strokes need them; see StrokePass.
struct Mattes {
    int width = 0, height = 0, groups = 1, variants = 0;
    float firstBeadCycles = 1, groupsPerOctave = 2, acrossDiameters = 1.25f;
    std::vector<float> prefix;     ///< layers x (height + 1), each ends at 1
    std::vector<float> densities;  ///< layers x height x width, each row has a mean of 1
};

/// -ln(1 - alpha) without cancellation for small alpha.
inline float opticalDepthOf(float alpha)
{
    return alpha < 0.01f ? alpha * (1.0f + alpha * (0.5f + alpha * (1.0f / 3.0f))) : -std::log(1.0f - alpha);
}

/// The steps of a sum, nearest, as the shaders round them: 0 <= value < 2^31.
inline std::uint32_t steps(float value)
{
    return std::uint32_t(std::int32_t(value + 0.5f));  // NOLINT(bugprone-incorrect-roundings): lround is a call
}

struct Frame {
    Features features;
    shared::FrameConstants constants;
    Mattes mattes;
    ConstImageViewF depth;          ///< [m]; features.depth
    std::vector<float> fogTable;    ///< optical depth; features.fog
    std::vector<float> veilTable;   ///< pairs, see frame.glsl; features.veil
    ImageF lightGrid, lowPassGrid;  ///< RGBA nodes, constants.lights.y pixels apart
    std::vector<float> lut;         ///< of the colour transfer, constants.lut.z nodes a side, RGB
    std::vector<shared::PointLight> lamps;
    std::vector<float> ringTransfer;  ///< D(theta) RGB, see FrameTargets

    /// Sums kept for each pixel: optical depth; with fog, weighted with the light that the fog in front lets through;
    /// with lamps, weighted with their radiance in the drop, RGB.
    int sumsPerPixel() const { return lampSums() + (features.lights ? 3 : 0); }
    int lampSums() const { return features.fog ? 2 : 1; }
    int width() const { return int(constants.picture.x); }
    int height() const { return int(constants.picture.y); }

    /// Optical depth of the fog to `depth` [m].
    float fogTo(float depth_m) const
    {
        const TablePlace at = placeOf(depth_m);
        return fogTable[at.entry] + (fogTable[at.entry + 1] - fogTable[at.entry]) * at.beyond;
    }
    /// Entry of the veil table where the picture is so deep.
    glm::vec2 veilTo(float depth_m) const
    {
        const TablePlace at = placeOf(depth_m);
        const float* pair = veilTable.data() + 2 * at.entry;
        return {pair[0] + (pair[2] - pair[0]) * at.beyond, pair[1] + (pair[3] - pair[1]) * at.beyond};
    }

private:
    struct TablePlace {
        std::size_t entry;
        float beyond;
    };
    TablePlace placeOf(float depth_m) const
    {
        constexpr float last = float(shared::fogTableSize - 1);
        const float place = depth_m < 1e30f ? depth_m / (depth_m + constants.focus.w) * last : last;
        const int entry = place < last ? int(place) : int(last) - 1;
        return {std::size_t(entry), place - float(entry)};
    }
};

/// Things to draw, and which of them reach into each band. Emptied, it keeps its memory for the next frame.
template <class Item>
struct BandedList {
    std::vector<Item> items;
    std::vector<std::vector<std::uint32_t>> ofBand;

    std::size_t bytes() const
    {
        std::size_t all = items.capacity() * sizeof(Item);
        for (const auto& band : ofBand) all += band.capacity() * sizeof(std::uint32_t);
        return all;
    }
    void clear(int bands)
    {
        items.clear();
        ofBand.resize(std::size_t(bands));
        for (auto& band : ofBand) band.clear();
    }
    /// low, high: the rows that it may touch.
    void add(const Item& item, float low, float high) { add(item, low, high, ofBand); }

protected:
    void add(const Item& item, float low, float high, std::vector<std::vector<std::uint32_t>>& bands)
    {
        const auto bandOf = [&](float row) {
            return std::size_t(std::clamp(row / float(bandRows), 0.0f, float(bands.size() - 1)));
        };
        const auto number = std::uint32_t(items.size());
        items.push_back(item);
        for (std::size_t band = bandOf(low); band <= bandOf(high); ++band) bands[band].push_back(number);
    }
};

/// Strokes that some of the cells show.
struct StrokeList : BandedList<shared::Stroke> {
    std::vector<glm::vec3> lamps;  ///< features.lights: their radiance in each stroke, fog in front taken off
    std::vector<std::vector<std::uint32_t>> smallOfBand;  ///< those that splatSmallStrokes() draws

    void clear(int bands)
    {
        BandedList::clear(bands);
        lamps.clear();
        smallOfBand.resize(std::size_t(bands));
        for (auto& band : smallOfBand) band.clear();
    }
    void addSmall(const shared::Stroke& stroke, float low, float high) { add(stroke, low, high, smallOfBand); }
    using BandedList::add;
};
/// Splashes that some of the picture shows.
using SplashList = BandedList<shared::Splash>;

/// What one band of rows gathers.
struct BandSums {
    int firstRow = 0, lastRow = 0;          ///< one past the last
    int perPixel = 1;                       ///< Frame::sumsPerPixel
    std::vector<std::uint32_t> sums;        ///< of the rain, rows x width x perPixel, and a few pixels beyond the last
    std::vector<std::uint32_t> splashSums;  ///< features.splashes
    std::vector<float> nearestDepth;        ///< features.nearest [m], +inf where no stroke is
    std::vector<std::uint32_t> motion;      ///< features.nearest: two halves [px]
};

}  // namespace virga::passes::cpu
