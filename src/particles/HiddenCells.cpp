#include "particles/HiddenCells.h"

#include <algorithm>
#include <cmath>

#include "core/Parallel.h"

namespace virga::particles {
namespace {

/// Depths that strokes have are floats, and so is the scene's: what is not farther by this share may be seen.
constexpr double nearlyBehind = 1e-4;

/// Maxima over squares of `side` pixels or tiles.
ImageF maximaOf(ConstImageViewF fine, int side)
{
    ImageF coarse((fine.width() + side - 1) / side, (fine.height() + side - 1) / side, 1);
    parallelFor(0, coarse.height(), 4, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (auto y = int(first); y < int(last); ++y) {
            float* to = coarse.row(y);
            std::fill_n(to, coarse.width(), 0.0f);
            for (int j = y * side; j < std::min((y + 1) * side, fine.height()); ++j) {
                const float* from = fine.row(j);
                for (int x = 0; x < coarse.width(); ++x) {
                    float greatest = to[x];
                    for (int i = x * side; i < std::min((x + 1) * side, fine.width()); ++i)
                        greatest = std::max(greatest, from[i]);
                    to[x] = greatest;
                }
            }
        }
    });
    return coarse;
}

}  // namespace

FarthestDepth::FarthestDepth(ConstImageViewF depth) : width_(depth.width()), height_(depth.height())
{
    levels_.push_back(maximaOf(depth, tile));
    nearestWall_ = *std::min_element(levels_[0].values().begin(), levels_[0].values().end());
    while (levels_.back().width() > 1 || levels_.back().height() > 1) levels_.push_back(maximaOf(levels_.back(), 2));
}

float FarthestDepth::in(double left, double top, double right, double bottom) const noexcept
{
    if (!(right >= 0 && bottom >= 0 && left < width_ && top < height_)) return 0;
    const auto tileOf = [](double place, int size) { return int(std::clamp(place, 0.0, double(size - 1))) / tile; };
    int x0 = tileOf(left, width_), x1 = tileOf(right, width_), y0 = tileOf(top, height_), y1 = tileOf(bottom, height_);
    std::size_t level = 0;
    for (; x1 - x0 > 1 || y1 - y0 > 1; ++level) x0 /= 2, x1 /= 2, y0 /= 2, y1 /= 2;
    const ImageF& tiles = levels_[level];
    return std::max({tiles.at(x0, y0), tiles.at(x1, y0), tiles.at(x0, y1), tiles.at(x1, y1)});
}

std::size_t FarthestDepth::bytes() const noexcept
{
    std::size_t all = 0;
    for (const ImageF& level : levels_) all += level.size() * sizeof(float);
    return all;
}

bool HiddenCells::hides(const glm::dvec3& centreAtOpen, const glm::dvec3& centreAtClose, double radius,
                        double diameter) const noexcept
{
    const StrokeLens& l = lens_;
    // A stroke's depth at a pixel is between those of its ends, so that both balls' count at either's pixels.
    const double nearest = std::min(-centreAtOpen.z, -centreAtClose.z) - radius;
    const double farthest = std::max(-centreAtOpen.z, -centreAtClose.z) + radius;
    if (!(nearest > std::max(l.near_m, double(depth_.nearestWall())))) return false;

    // How far from its path a stroke is drawn: half widths to the side and beyond its ends, aslant, the wider of
    // profile and matte; blur along the path; pixels that it only touches.
    const double width = l.greatestFocal_px * diameter / nearest;
    const double confusion =
        l.greatestFocal_px * l.aperture_m *
        std::max(std::abs(1 / nearest - l.inverseFocus_1_m), std::abs(1 / farthest - l.inverseFocus_1_m));
    const double half = 0.5 * std::hypot(width, confusion);
    const double reach = 2.5 * std::max(1.0, l.matteWidthDiameters) * half + 0.5 * confusion + 4;

    const auto isBehind = [&](const glm::dvec3& centre) {
        const auto high = [&](double place) {
            return place > 0 ? l.greatestFocal_px * place / nearest : l.leastFocal_px * place / farthest;
        };
        const double right = l.axisX_px + high(centre.x + radius), left = l.axisX_px - high(-centre.x + radius);
        const double bottom = l.axisY_px + high(-centre.y + radius), top = l.axisY_px - high(centre.y + radius);
        return nearest * (1 - nearlyBehind) >
               double(depth_.in(left - reach, top - reach, right + reach, bottom + reach));
    };
    return isBehind(centreAtOpen) && (centreAtClose == centreAtOpen || isBehind(centreAtClose));
}

}  // namespace virga::particles
