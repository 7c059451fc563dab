// Where a frame lies against another, roughly and from nothing: features of both are matched, and a homography is
// chosen that explains most of the matches. Where there are too few features to do so it says so, and the caller goes
// on without.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "core/Image.h"
#include "matte/PlaneTransform.h"

namespace virga::matte::alignment {

inline constexpr std::size_t fewestMatches = 8;  // that a homography is believed on

/// SIFT (Lowe 2004).
struct Features {
    std::vector<Point> places;       // normalised
    std::vector<float> descriptors;  // 128 a place
};

/// Of a level's picture, `most` of them at most.
Features featuresOf(const ImageF& picture, const Grid& grid, int level, int most);

/// Takes normalised coordinates of `from` to those of `to`: the least truncated squares (MSAC, Torr and Zisserman 2000)
/// over similarities of two matches and homographies of four, then least squares over what it explains within the
/// tolerance (normalised). Nothing if that is too little.
std::optional<PlaneTransform> roughTransform(const Features& from, const Features& to, double tolerance);

}  // namespace virga::matte::alignment
