#include "passes/CpuBlur.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/Lanes.h"
#include "core/Parallel.h"

namespace virga::passes::cpu {
namespace {

using lanes::Float;

/// A picture channel by channel, with a frame of nothing around it that taps may reach into: its sigma is 0, which
/// gives it no weight.
class Planes {
public:
    Planes(int width, int height, int margin)
        : margin_(margin), stride_(width + 2 * margin + lanes::count),
          planes_(std::size_t(stride_) * std::size_t(height + 2 * margin) * 4)
    {
        planeSize_ = planes_.size() / 4;
    }
    /// x and y from -margin.
    float* at(int channel, int x, int y)
    {
        return planes_.data() + std::size_t(channel) * planeSize_ + std::size_t(y + margin_) * std::size_t(stride_) +
               std::size_t(x + margin_);
    }
    std::ptrdiff_t stride() const { return stride_; }

private:
    int margin_, stride_;
    std::vector<float> planes_;
    std::size_t planeSize_;
};

float sigmaAt(const Frame& frame, int x, int y)
{
    const shared::FrameConstants& c = frame.constants;
    return frame.features.depth ? c.grade.z * (1.0f - std::exp(-frame.depth.row(y)[x] / c.grade.w)) : c.grade.z;
}

/// Eight pixels of four channels, one direction: taps `step` numbers apart.
VIRGA_INLINE void blurEight(const float* const (&source)[4], const float* sigmas, std::ptrdiff_t step, Float (&out)[4])
{
    const Float own = lanes::load(sigmas);
    float reaches[lanes::count];
    lanes::store(own * 3.0f, reaches);
    const int most = int(std::ceil(*std::max_element(reaches, reaches + lanes::count)));
    for (int k = 0; k < 4; ++k) out[k] = lanes::load(source[k]);
    if (most == 0) return;
    Float sum[4] = {out[0], out[1], out[2], out[3]}, weights = 1.0f;
    const Float perOwn = Float(1.0f) / lanes::max(own, 1e-6f);
    for (int tap = -most; tap <= most; ++tap) {
        if (tap == 0) continue;
        const Float sigma = lanes::min(own, lanes::load(sigmas + tap * step));
        const Float spread = lanes::max(sigma * sigma, 1e-4f);
        const Float share = sigma * perOwn;
        Float weight = lanes::exp(Float(-0.5f * float(tap * tap)) / spread) * (share * share);
        // Each pixel as far as its own blur reaches: ceil(3 sigma).
        weight = lanes::pick(own * 3.0f > float(std::abs(tap)) - 1.0f, weight, 0.0f);
        for (int k = 0; k < 4; ++k) sum[k] = sum[k] + weight * lanes::load(source[k] + tap * step);
        weights = weights + weight;
    }
    const lanes::Mask isBlurred = own >= 0.05f;
    for (int k = 0; k < 4; ++k) out[k] = lanes::pick(isBlurred, sum[k] / weights, out[k]);
}

VIRGA_SIMD void blurAcross(Planes& from, Planes& sigma, Planes& to, int width, int y)
{
    for (int x = 0; x < width; x += lanes::count) {
        const float* const source[4] = {from.at(0, x, y), from.at(1, x, y), from.at(2, x, y), from.at(3, x, y)};
        Float out[4];
        blurEight(source, sigma.at(0, x, y), 1, out);
        float last[lanes::count];
        const int here = std::min(lanes::count, width - x);
        for (int k = 0; k < 4; ++k) {
            lanes::store(out[k], last);
            std::copy_n(last, here, to.at(k, x, y));
        }
    }
}

VIRGA_SIMD void blurDown(Planes& from, Planes& sigma, ImageView<float> picture, int y)
{
    for (int x = 0; x < picture.width(); x += lanes::count) {
        const float* const source[4] = {from.at(0, x, y), from.at(1, x, y), from.at(2, x, y), from.at(3, x, y)};
        Float out[4];
        blurEight(source, sigma.at(0, x, y), from.stride(), out);
        float planes[4][lanes::count];
        for (int k = 0; k < 4; ++k) lanes::store(out[k], planes[k]);
        const int here = std::min(lanes::count, picture.width() - x);
        for (int i = 0; i < here; ++i)
            for (int k = 0; k < 4; ++k) picture.pixel(x + i, y)[k] = planes[k][i];
    }
}

}  // namespace

void blurPicture(const Frame& frame, ImageView<float> picture)
{
    const int width = frame.width(), height = frame.height();
    const int margin = int(std::ceil(3.0f * frame.constants.grade.z)) + 1;
    Planes sharp(width, height, margin), across(width, height, margin), sigma(width, height, margin);
    const auto everyRow = [&](auto&& body) {
        parallelFor(0, height, 8, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (auto y = int(first); y < int(last); ++y) body(y);
        });
    };
    everyRow([&](int y) {
        for (int x = 0; x < width; ++x) {
            *sigma.at(0, x, y) = sigmaAt(frame, x, y);
            for (int k = 0; k < 4; ++k) *sharp.at(k, x, y) = picture.at(x, y, k);
        }
    });
    everyRow([&](int y) { blurAcross(sharp, sigma, across, width, y); });
    everyRow([&](int y) { blurDown(across, sigma, picture, y); });
}

}  // namespace virga::passes::cpu
