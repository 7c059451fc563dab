#include "shot/MatteModel.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/Parallel.h"

namespace virga::shot {
namespace {

constexpr double leastContrast = 0.01;  // of a stroke's alpha, unless the noise is less

double medianOf(std::vector<float> values)
{
    if (values.empty()) return 0.0;
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

}  // namespace

MatteModel::MatteModel(ModelSpace space, const std::array<float, 3>& color, const std::array<float, 3>& shown)
    : space_(space), color_(color), isRecoloured_(color != shown)
{
    ImageF one(1, 1, 3);
    std::copy_n(shown.begin(), 3, one.data());
    fromModel(one, space);
    std::copy_n(one.data(), 3, linearColor_.begin());
}

/// Most alphas are 0, and stay: what is more than that is asked a row at a time.
ImageF MatteModel::toLinearAlpha(const ImageF& alpha, const ImageF& scene) const
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
matte::RainStrokeOptions MatteModel::strokeOptions(const matte::Extraction& found) const
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

}  // namespace virga::shot
