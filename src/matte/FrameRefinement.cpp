#include "matte/FrameRefinement.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "matte/IntegerHash.h"
#include "matte/PictureSampling.h"

namespace virga::matte::alignment {
namespace {

constexpr int unknowns = parameters + 2;  // and gain and offset
constexpr int mostSamples = 50'000;       // pixels of a level that have a say
constexpr int fewestSamples = 48;         // that a level needs
// Residuals are of the scene and of rain, which may be on most pixels of two frames together: their spread is read from
// the least quarter of them, as of a normal distribution, and what is beyond three of it has no say.
constexpr double scaleQuantile = 0.25, scaleOfQuantile = 0.3186, scaleOfMedian = 0.6745;
constexpr double steady_px = 2e-3;  // a step this small ends the iteration

/// Directions in which a homography can change, as velocities at normalised (u, v): shift, rotation, scale; two shears;
/// perspective. Row by row, as a PlaneTransform.
constexpr std::array<std::array<double, 9>, parameters> generators = {{
    {0, 0, 1, 0, 0, 0, 0, 0, 0},
    {0, 0, 0, 0, 0, 1, 0, 0, 0},
    {0, -1, 0, 1, 0, 0, 0, 0, 0},
    {1, 0, 0, 0, 1, 0, 0, 0, 0},
    {1, 0, 0, 0, -1, 0, 0, 0, 0},
    {0, 1, 0, 1, 0, 0, 0, 0, 0},
    {0, 0, 0, 0, 0, 0, -1, 0, 0},
    {0, 0, 0, 0, 0, 0, 0, -1, 0},
}};

using Velocities = Eigen::Matrix<double, 2, parameters>;

/// The same at a point.
Velocities velocities(double u, double v)
{
    Velocities m;
    m << 1, 0, -v, u, u, v, u * u, u * v,  //
        0, 1, u, v, -v, u, u * v, v * v;
    return m;
}

}  // namespace

std::vector<Sample> samplesOf(const ImageF& picture, const Grid& grid, int level)
{
    std::vector<Sample> result;
    const int width = picture.width(), height = picture.height();
    if (width < 5 || height < 5) return result;
    std::vector<float> squares;
    squares.reserve(picture.size());
    for (int y = 2; y < height - 2; ++y)
        for (int x = 2; x < width - 2; ++x) squares.push_back(gradientAt(picture, x, y).square());
    const std::size_t pixels = squares.size();
    const auto middle = squares.begin() + std::ptrdiff_t(pixels / 2);
    std::nth_element(squares.begin(), middle, squares.end());
    const float least = *middle;
    // Flat pictures have a median of 0, and then all that is not flat counts.
    const double share = 2.0 * mostSamples / double(pixels);
    const std::uint32_t most = share >= 1 ? ~0u : std::uint32_t(share * 4294967295.0);
    const PlaneTransform normalised = grid.pixels(level).inverse();
    const double scale = grid.pixelScale(level);
    for (int y = 2; y < height - 2; ++y) {
        for (int x = 2; x < width - 2; ++x) {
            const Gradient g = gradientAt(picture, x, y);
            if (g.square() < least || g.square() <= 0) continue;
            if (hashed(std::uint32_t(y) * std::uint32_t(width) + std::uint32_t(x)) > most) continue;
            const Point at = normalised(x, y);
            const Velocities v = velocities(at.x, at.y);
            Sample sample{float(at.x), float(at.y), picture.at(x, y), {}};
            for (int i = 0; i < parameters; ++i)
                sample.change[std::size_t(i)] = float(scale * (g.x * v(0, i) + g.y * v(1, i)));
            result.push_back(sample);
        }
    }
    return result;
}

std::optional<Fit> refined(std::span<const Sample> from, const ImageF& to, const Grid& grid, int level, Fit fit,
                           int freedom, int steps)
{
    if (from.size() < fewestSamples) return std::nullopt;
    const PlaneTransform pixels = grid.pixels(level);
    const double aspectU = grid.centreX / grid.scale, aspectV = grid.centreY / grid.scale;
    std::vector<float> values(from.size()), errors, sizes;
    for (int step = 0; step < steps; ++step) {
        const std::array<double, 9> warp = (pixels * fit.frame).m;
        errors.assign(from.size(), std::numeric_limits<float>::infinity());
        sizes.clear();
        for (std::size_t i = 0; i < from.size(); ++i) {
            const Sample& s = from[i];
            const double w = warp[6] * s.u + warp[7] * s.v + warp[8];
            if (!(w > 0.1)) continue;
            const double x = (warp[0] * s.u + warp[1] * s.v + warp[2]) / w;
            const double y = (warp[3] * s.u + warp[4] * s.v + warp[5]) / w;
            if (!sampleInside(to, x, y, values[i])) continue;
            errors[i] = float(fit.gain) * values[i] + float(fit.offset) - s.value;
            sizes.push_back(std::abs(errors[i]));
        }
        if (sizes.size() < fewestSamples) return std::nullopt;
        const auto middle = sizes.begin() + std::ptrdiff_t(sizes.size() / 2);
        std::nth_element(sizes.begin(), middle, sizes.end());
        fit.spread = std::max(leastScale, double(*middle) / scaleOfMedian);
        const auto rank = sizes.begin() + std::ptrdiff_t(scaleQuantile * double(sizes.size()));
        std::nth_element(sizes.begin(), rank, middle);
        fit.sigma = std::max(leastScale, double(*rank) / scaleOfQuantile);
        const float limit = float(biweight * fit.sigma);

        // template + change p = (gain + dGain) frame + offset + dOffset
        std::array<double, unknowns*(unknowns + 1) / 2> upper{};
        std::array<double, unknowns> right{};
        for (std::size_t i = 0; i < from.size(); ++i) {
            if (!(std::abs(errors[i]) < limit)) continue;
            const float t = errors[i] / limit, weight = (1 - t * t) * (1 - t * t);
            std::array<float, unknowns> row;
            for (std::size_t k = 0; k < parameters; ++k) row[k] = from[i].change[k];
            row[parameters] = -values[i];
            row[parameters + 1] = -1;
            std::size_t n = 0;
            for (std::size_t k = 0; k < unknowns; ++k) {
                const float weighted = weight * row[k];
                right[k] += double(weighted * errors[i]);
                for (std::size_t j = k; j < unknowns; ++j) upper[n++] += double(weighted * row[j]);
            }
        }
        // Parameters that are held are left out of the equations.
        const int size = freedom + 2;
        const auto place = [&](int k) { return k < freedom ? k : parameters + k - freedom; };
        Eigen::MatrixXd normal(size, size);
        Eigen::VectorXd rhs(size);
        for (int k = 0; k < size; ++k) {
            rhs(k) = right[std::size_t(place(k))];
            for (int j = k; j < size; ++j) {
                const int a = place(k), b = place(j);
                normal(k, j) = normal(j, k) = upper[std::size_t(a * unknowns - a * (a - 1) / 2 + b - a)];
            }
        }
        const Eigen::LDLT<Eigen::MatrixXd> solver(normal);
        if (solver.info() != Eigen::Success || !solver.isPositive() || !(solver.rcond() > 1e-12)) return std::nullopt;
        const Eigen::VectorXd by = solver.solve(rhs);
        if (!by.allFinite()) return std::nullopt;

        PlaneTransform change;
        for (int k = 0; k < freedom; ++k)
            for (std::size_t i = 0; i < 9; ++i) change.m[i] += by(k) * generators[std::size_t(k)][i];
        const double determinant = change.determinant();
        if (!(determinant > 0.1 && determinant < 10)) return std::nullopt;
        fit.frame = fit.frame * change.inverse();
        fit.frame = fit.frame.dividedBy(std::cbrt(std::abs(fit.frame.determinant())));
        fit.gain += by(freedom);
        fit.offset += by(freedom + 1);
        if (!fit.frame.isFinite() || !(fit.gain > 0.1 && fit.gain < 10)) return std::nullopt;

        const Eigen::MatrixXd covariance =
            solver.solve(Eigen::MatrixXd::Identity(size, size)).topLeftCorner(freedom, freedom);
        double moved = 0;
        fit.loose_px = 0;
        for (int corner = 0; corner < 4; ++corner) {
            const Eigen::MatrixXd v =
                grid.pixelScale(level) *
                velocities(corner % 2 ? aspectU : -aspectU, corner / 2 ? aspectV : -aspectV).leftCols(freedom);
            moved = std::max(moved, (v * by.head(freedom)).norm());
            const double variance = (v * covariance * v.transpose()).trace();
            fit.loose_px = std::max(fit.loose_px, fit.sigma * std::sqrt(correlatedPixels * std::max(0.0, variance)));
        }
        if (moved < steady_px) break;
    }
    return fit;
}

}  // namespace virga::matte::alignment
