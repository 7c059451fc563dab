// The passes of a small picture, run on strokes that a test places by hand.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "core/Image.h"
#include "gl/Context.h"
#include "matte/OscillatingDrops.h"
#include "passes/BlurPass.h"
#include "passes/CompositePass.h"
#include "passes/FrameTargets.h"
#include "passes/LightPass.h"
#include "passes/StrokePass.h"

namespace virga::passes::test {

/// A stroke as it should fall on the picture.
struct Wanted {
    glm::dvec2 start, end;  // [px]
    double width = 1;       // of the drop [px]
    double depth = 5;       // at the start [m]
    double depthEnd = 0;    // 0: the same
};

inline ImageF uniform(int width, int height, int channels, float value)
{
    return ImageF(width, height, channels, value);
}

inline ImageF opaque(int width, int height, float r, float g, float b)
{
    ImageF image(width, height, 4);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            float* p = image.pixel(x, y);
            p[0] = r, p[1] = g, p[2] = b, p[3] = 1;
        }
    return image;
}

inline Features onSoftware(Features features)
{
    features.software = true;
    return features;
}
inline const matte::StrokeAtlas& atlas(float liveliness)
{
    static const matte::StrokeAtlas lively = matte::makeOscillatingDropAtlas(1);
    static const matte::StrokeAtlas plain =
        matte::makeOscillatingDropAtlas(1, {.groups = 1, .variants = 2, .liveliness = 0});
    return liveliness > 0 ? lively : plain;
}

class Picture {
public:
    Picture(int width, int height, Features wanted, float liveliness = 1)
        : features(onSoftware(wanted)), targets(width, height, features), composite_(features)
    {
        const float half = 0.5f;
        constants.cameraFromWorldOpen = constants.cameraFromWorldClose = glm::mat4(1.0f);
        constants.lens = {focal, focal, half * float(width), half * float(height)};
        constants.boost.w = focal;
        constants.range = {0.01f, 1e4f, 1e-9f, 1.0f};
        constants.focus = {0.0f, 0.2f, 0.01f, 20.0f};
        constants.picture = {std::uint32_t(width), std::uint32_t(height), 0, 1};
        constants.grade = {0.0f, 0.0f, 0.0f, 50.0f};
        if (features.rain) strokes_.emplace(features, atlas(liveliness));
        if (features.light()) light_.emplace(features);
        if (features.blur) blur_.emplace(features);
        if (features.light()) {
            const ImageF white = uniform(8, 4, 3, 1);
            targets.uploadDropRadiance(white, white);
        }
    }

    /// One cell of no size a stroke, and a class for each.
    particles::CellList listOf(const std::vector<Wanted>& wanted) const
    {
        particles::CellList list;
        for (const Wanted& w : wanted) {
            const auto at = [&](const glm::dvec2& px, double depth) {
                const double scale = depth / double(focal);
                return glm::dvec3((px.x - 0.5 * targets.width()) * scale, (0.5 * targets.height() - px.y) * scale,
                                  -depth);
            };
            const double depthEnd = w.depthEnd > 0 ? w.depthEnd : w.depth;
            const glm::dvec3 open = at(w.start, w.depth), close = at(w.end, depthEnd);
            const float diameter = float(w.width * 0.5 * (w.depth + depthEnd) / double(focal));
            const auto number = std::uint32_t(list.cells.size());
            list.classes.push_back({{diameter, diameter, 1.0f, 0.0f}, {glm::vec3(close - open), 0.0f}, glm::vec4(0.0f)});
            list.cells.push_back(
                {{0x9e3779b9u * (number + 1), number * 77u, number, number}, {glm::vec3(open), 0.0f}, glm::vec4(0.0f)});
            if (number % shared::dropsPerBlock == 0) list.blocks.push_back(number);
        }
        list.drops = list.cells.size();
        return list;
    }

    ImageF render(const ImageF& plate, const particles::CellList& list = {})
    {
        if (features.rain) strokes_->describe(constants, list);
        targets.uploadPlate(plate);
        targets.setConstants(constants);
        targets.bind();
        timer_.begin();
        if (light_) light_->run(targets);
        if (blur_) blur_->run(targets);
        if (strokes_) strokes_->run(targets, list, timer_);
        composite_.run(targets);
        return targets.readBeauty();
    }

    /// Matte value of the rain, one channel.
    ImageF rainAlpha(const particles::CellList& list)
    {
        render(ImageF(targets.width(), targets.height(), 4), list);
        const ImageF layer = targets.readLayer(FrameTargets::LayerIndex::Rain);
        ImageF alpha(layer.width(), layer.height(), 1);
        for (std::size_t i = 0; i < alpha.size(); ++i) alpha.data()[i] = layer.data()[4 * i + 3];
        return alpha;
    }
    ImageF rainAlpha(const std::vector<Wanted>& wanted) { return rainAlpha(listOf(wanted)); }

    std::size_t strokeCount() const { return strokes_->strokeCount(); }

    static constexpr float focal = 500;  // [px]
    Features features;
    FrameTargets targets;
    shared::FrameConstants constants{};

private:
    std::optional<LightPass> light_;
    std::optional<StrokePass> strokes_;
    std::optional<BlurPass> blur_;
    CompositePass composite_;
    gl::PassTimer timer_;
};

inline double sumOf(const ImageF& image)
{
    double sum = 0;
    for (const float value : image.values()) sum += double(value);
    return sum;
}

inline glm::dvec2 centroidOf(const ImageF& image)
{
    glm::dvec2 sum(0);
    for (int y = 0; y < image.height(); ++y)
        for (int x = 0; x < image.width(); ++x) sum += double(image.at(x, y)) * glm::dvec2(x + 0.5, y + 0.5);
    return sum / sumOf(image);
}

}  // namespace virga::passes::test
