#include "matte/FrameNeighbourhood.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/Parallel.h"
#include "matte/PictureSampling.h"

namespace virga::matte::alignment {
namespace {

constexpr std::size_t medianFrames = 9;  // that a picture without rain is made of

}  // namespace

FrameNeighbourhood::FrameNeighbourhood(std::size_t anchor, std::span<const std::optional<PlaneTransform>> placed,
                                       const Grid& grid, const std::function<ImageF(std::size_t)>& pictureOf)
{
    for (std::size_t k = 0; k < placed.size(); ++k)
        if (placed[k]) frames_.push_back(k);
    const auto distance = [anchor](std::size_t k) { return k > anchor ? k - anchor : anchor - k; };
    std::stable_sort(frames_.begin(), frames_.end(),
                     [&](std::size_t a, std::size_t b) { return distance(a) < distance(b); });
    if (frames_.size() > medianFrames) frames_.resize(medianFrames);
    pictures_.resize(frames_.size());
    const PlaneTransform pixels = grid.pixels(0), referenceFromAnchor = placed[anchor]->inverse();
    const auto inGridOfAnchor = [&](std::size_t k) {
        ImageF picture = pictureOf(k);
        if (k == anchor) return picture;
        const PlaneTransform warp = pixels * *placed[k] * referenceFromAnchor * pixels.inverse();
        ImageF warped(picture.width(), picture.height(), 1, std::numeric_limits<float>::quiet_NaN());
        for (int y = 0; y < warped.height(); ++y) {
            for (int x = 0; x < warped.width(); ++x) {
                const Point at = warp(x, y);
                sampleInside(picture, at.x, at.y, warped.at(x, y));
            }
        }
        return warped;
    };
    parallelFor(0, std::ptrdiff_t(frames_.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (std::size_t i = std::size_t(first); i < std::size_t(last); ++i) pictures_[i] = inGridOfAnchor(frames_[i]);
    });
}

bool FrameNeighbourhood::contains(std::size_t k) const
{
    return std::find(frames_.begin(), frames_.end(), k) != frames_.end();
}

ImageF FrameNeighbourhood::medianWithout(std::size_t k) const
{
    ImageF result(pictures_[0].width(), pictures_[0].height(), 1);
    std::vector<float> values;
    for (std::size_t i = 0; i < result.size(); ++i) {
        values.clear();
        for (std::size_t j = 0; j < frames_.size(); ++j) {
            const float value = pictures_[j].data()[i];
            if (frames_[j] != k && !std::isnan(value)) values.push_back(value);
        }
        if (values.empty()) continue;
        const auto middle = values.begin() + std::ptrdiff_t((values.size() - 1) / 2);  // the lower: rain is bright
        std::nth_element(values.begin(), middle, values.end());
        result.data()[i] = *middle;
    }
    return result;
}

}  // namespace virga::matte::alignment
