// The maths of the alignment: transforms of the plane, and those that pairs of points ask for. Inside the alignment
// only; the world outside has Homography.
//
// Coordinates are normalised (Grid) or pixels of a pyramid's level, pixel centres at integers. A transform has no scale
// of its own: m and 2 m take a point to the same place. Nothing here throws.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>

namespace virga::matte::alignment {

struct Point {
    double x, y;
};

inline double squaredDistance(Point a, Point b)
{
    const double x = a.x - b.x, y = a.y - b.y;
    return x * x + y * y;
}

/// Row by row, as in Homography.
struct PlaneTransform {
    std::array<double, 9> m = {1, 0, 0, 0, 1, 0, 0, 0, 1};

    /// Of a point; not finite where it lies on the horizon.
    Point operator()(double x, double y) const
    {
        // Grouped as Eigen's product groups it, which operator* is: another order is another last bit.
        const double w = m[6] * x + (m[7] * y + m[8]);
        return {(m[0] * x + m[1] * y + m[2]) / w, (m[3] * x + m[4] * y + m[5]) / w};
    }
    /// First the other, then this.
    PlaneTransform operator*(const PlaneTransform& other) const;
    /// Not finite of a singular one.
    PlaneTransform inverse() const;
    double determinant() const;
    bool isFinite() const;
    /// Every number; the same transform.
    PlaneTransform dividedBy(double scale) const;
};

/// Pixel coordinates with centres at integers, moved and scaled such that a picture spans -1..1 on its longer side: the
/// same for all levels of its pyramid, whose pixel (x, y) lies at (2^level x, 2^level y) of the picture.
struct Grid {
    double centreX, centreY, scale;
    Grid(int width, int height)
        : centreX(0.5 * (width - 1)), centreY(0.5 * (height - 1)), scale(0.5 * std::max(width, height))
    {
    }
    /// Of a normalised unit in a level [px].
    double pixelScale(int level) const { return std::ldexp(1.0, -level) * scale; }
    /// Takes normalised coordinates to pixels of a level.
    PlaneTransform pixels(int level) const
    {
        const double s = std::ldexp(1.0, -level);
        return {{s * scale, 0, s * centreX, 0, s * scale, s * centreY, 0, 0, 1}};
    }
};

/// One thing in two pictures, normalised.
struct Match {
    Point from, to;
};

/// The homography of some matches by least squares of the linear equations (DLT). Coordinates are within about 1
/// already. Nothing where it would be next to singular.
std::optional<PlaneTransform> homographyOf(std::span<const Match> matches, std::span<const std::size_t> which);

/// The similarity of two or more matches, by least squares. Nothing where they lie in one point.
std::optional<PlaneTransform> similarityOf(std::span<const Match> matches, std::span<const std::size_t> which);

/// A camera that shakes does not zoom by a half nor stand on its head between two frames. Normalised coordinates.
bool isPlausible(const PlaneTransform& transform);

/// Share of a picture's area that a transform of normalised coordinates leaves inside it, 0..1.
double overlapOf(const PlaneTransform& frame, const Grid& grid);

}  // namespace virga::matte::alignment
