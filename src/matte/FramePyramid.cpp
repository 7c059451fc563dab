#include "matte/FramePyramid.h"

#include <algorithm>
#include <cmath>

namespace virga::matte::alignment {
namespace {

double brightness(const float* p, int channels)
{
    double sum = 0;
    for (int c = 0; c < channels; ++c) sum += std::isfinite(p[c]) ? double(p[c]) : 0.0;
    return sum / channels;
}

ImageF prepared(const ImageF& frame, const BrightnessRange& range)
{
    ImageF picture(frame.width(), frame.height(), 1);
    const std::size_t channels = std::size_t(frame.channels());
    const double gain = 1 / (range.high - range.low);
    for (std::size_t i = 0; i < picture.size(); ++i) {
        const double v = (brightness(frame.data() + i * channels, frame.channels()) - range.low) * gain;
        picture.data()[i] = float(v < 0 ? -std::log1p(-v) : v > 1 ? 1 + std::log(v) : v);
    }
    return picture;
}

/// Binomial, standard deviation 1 px, edges repeated; every `step`-th pixel and row of it.
ImageF smoothed(const ImageF& picture, int step)
{
    const int width = picture.width(), height = picture.height();
    const int outWidth = (width + step - 1) / step, outHeight = (height + step - 1) / step;
    ImageF result(outWidth, outHeight, 1);
    std::vector<float> line(std::size_t(width) + 4);
    for (int y = 0; y < outHeight; ++y) {
        const float* rows[5];
        for (int k = 0; k < 5; ++k) rows[k] = picture.row(std::clamp(y * step + k - 2, 0, height - 1));
        float* l = line.data() + 2;
        for (int x = 0; x < width; ++x)
            l[x] = (rows[0][x] + rows[4][x] + 4 * (rows[1][x] + rows[3][x]) + 6 * rows[2][x]) / 16;
        l[-1] = l[-2] = l[0];
        l[width] = l[width + 1] = l[width - 1];
        float* out = result.row(y);
        for (int x = 0; x < outWidth; ++x) {
            const float* m = l + x * step;
            out[x] = (m[-2] + m[2] + 4 * (m[-1] + m[1]) + 6 * m[0]) / 16;
        }
    }
    return result;
}

}  // namespace

BrightnessRange rangeOf(const ImageF& frame)
{
    const std::size_t channels = std::size_t(frame.channels()), pixels = frame.size() / channels;
    const std::size_t stride = pixels / 50'000 + 1 + (pixels / 50'000) % 2;  // odd: walks through all columns
    std::vector<double> values;
    for (std::size_t i = 0; i < pixels; i += stride)
        values.push_back(brightness(frame.data() + i * channels, frame.channels()));
    std::sort(values.begin(), values.end());
    if (values.empty()) return {};
    BrightnessRange range{values[values.size() / 100], values[values.size() - 1 - values.size() / 100]};
    if (range.empty()) range = {values.front(), values.back()};  // lamps in the night
    // A constant that does not add up to itself is no contrast.
    if (range.high - range.low < 1e-5 * std::max(std::abs(range.high), std::abs(range.low))) range = {};
    return range;
}

ImageF smoothedBrightness(const ImageF& frame, const BrightnessRange& range)
{
    return smoothed(prepared(frame, range), 1);
}

Pyramid pyramidOf(const ImageF& frame, const BrightnessRange& range)
{
    Pyramid levels;
    levels.push_back(smoothedBrightness(frame, range));
    while (std::min(levels.back().width(), levels.back().height()) >= 2 * topSide)
        levels.push_back(smoothed(levels.back(), 2));
    return levels;
}

}  // namespace virga::matte::alignment
