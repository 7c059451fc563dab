#include "matte/FrameWarp.h"

#include <algorithm>
#include <cstddef>

#include "core/Parallel.h"
#include "matte/PictureSampling.h"

namespace virga::matte {
namespace {

ImageF resampled(const ImageF& source, const Homography& sourceFromTarget, ImageF* covered)
{
    const int width = source.width(), height = source.height(), channels = source.channels();
    ImageF result(width, height, channels);
    if (covered) *covered = ImageF(width, height, 1);
    parallelFor(0, height, 16, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y) {
            for (int x = 0; x < width; ++x) {
                const auto& m = sourceFromTarget.m;
                const double px = x + 0.5, py = y + 0.5, w = m[6] * px + m[7] * py + m[8];
                if (!(w > 1e-9)) continue;
                const double sx = (m[0] * px + m[1] * py + m[2]) / w - 0.5;
                const double sy = (m[3] * px + m[4] * py + m[5]) / w - 0.5;
                if (!(sx >= 0 && sy >= 0 && sx <= width - 1 && sy <= height - 1)) continue;
                if (covered) covered->at(x, y) = 1;
                const int x0 = int(sx), y0 = int(sy);
                const auto wx = alignment::cubicWeights(float(sx - x0)), wy = alignment::cubicWeights(float(sy - y0));
                float* out = result.pixel(x, y);
                for (int j = 0; j < 4; ++j) {
                    if (wy[std::size_t(j)] == 0) continue;
                    const float* row = source.row(std::clamp(y0 + j - 1, 0, height - 1));
                    for (int i = 0; i < 4; ++i) {
                        const float weight = wx[std::size_t(i)] * wy[std::size_t(j)];
                        if (weight == 0) continue;
                        const float* p = row + std::ptrdiff_t(std::clamp(x0 + i - 1, 0, width - 1)) * channels;
                        for (int c = 0; c < channels; ++c) out[c] += weight * p[c];
                    }
                }
            }
        }
    });
    return result;
}

}  // namespace

ImageF warpToReference(const ImageF& frame, const Homography& referenceFromFrame, ImageF* covered)
{
    return resampled(frame, referenceFromFrame.inverse(), covered);
}

ImageF warpFromReference(const ImageF& picture, const Homography& referenceFromFrame, ImageF* covered)
{
    return resampled(picture, referenceFromFrame, covered);
}

}  // namespace virga::matte
