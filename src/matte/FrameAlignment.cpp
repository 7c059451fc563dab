#include "matte/FrameAlignment.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numeric>
#include <opencv2/features2d.hpp>
#include <optional>

#include "core/Error.h"
#include "core/Parallel.h"

namespace virga::matte {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int parameters = 8;             // of a homography
constexpr int unknowns = parameters + 2;  // and gain and offset
constexpr int smallestSide = 16;          // of a picture that is looked at [px]
constexpr int topSide = 24;               // no level of the pyramid has a smaller side [px]
constexpr int featureSide = 500;          // features are looked for in the first level whose sides are no longer
constexpr int mostSamples = 50'000;       // pixels of a level that have a say
constexpr int fewestSamples = 48;         // that a level needs
// Residuals are of the scene and of rain, which may be on most pixels of two frames together: their spread is read from
// the least quarter of them, as of a normal distribution, and what is beyond three of it has no say.
constexpr double scaleQuantile = 0.25, scaleOfQuantile = 0.3186, scaleOfMedian = 0.6745;
constexpr double biweight = 3.0;
constexpr double leastScale = 2e-3;        // of residuals, over the reference's range
constexpr double steady_px = 2e-3;         // a step this small ends the iteration
constexpr double correlatedPixels = 12;    // 4 pi sigma^2: pixels that share their noise after a blur of sigma = 1
constexpr double loosest_px = 0.5;         // standard deviation at the corners that a model may have
constexpr double matchTolerance_px = 1.5;  // in the picture that features are found in
constexpr std::size_t fewestMatches = 8;
constexpr double inlierDistance_px = 1.0;  // of a cell from its place
constexpr double cellPrecision_px = 0.25;  // standard deviation of a cell that counts as textured
constexpr double cellLikeness = 0.7;       // correlation of a cell with itself in the frame
constexpr int fewestInliers = 4;           // cells
constexpr std::size_t medianFrames = 9;    // that a picture without rain is made of
constexpr int polishes = 2;  // a second is what clips of few frames need: 0.04 px become 0.03, with movers 0.08 0.03
constexpr std::size_t fewestMedianFrames = 5;  // of fewer it is no better than a frame

/// Pixel coordinates with centres at integers, moved and scaled such that a picture spans -1..1 on its longer side: the
/// same for all levels of its pyramid, whose pixel (x, y) lies at (2^level x, 2^level y) of the picture.
struct Grid {
    double centreX, centreY, scale;
    Grid(int width, int height)
        : centreX(0.5 * (width - 1)), centreY(0.5 * (height - 1)), scale(0.5 * std::max(width, height))
    {
    }
    /// Takes normalised coordinates to pixels of a level.
    Matrix3d pixels(int level) const
    {
        const double s = std::ldexp(1.0, -level);
        Matrix3d m;
        m << s * scale, 0, s * centreX, 0, s * scale, s * centreY, 0, 0, 1;
        return m;
    }
};

// ---------------------------------------------------------------------------------------------------------- pictures

/// Brightness as one number a pixel, the reference's first to 99th percentile on 0..1, logarithmic beyond: one lamp in
/// a linear picture is not worth more than all else.
struct Range {
    double low = 0, high = 0;
    bool empty() const { return !(high > low); }
};

double brightness(const float* p, int channels)
{
    double sum = 0;
    for (int c = 0; c < channels; ++c) sum += std::isfinite(p[c]) ? double(p[c]) : 0.0;
    return sum / channels;
}

Range rangeOf(const ImageF& frame)
{
    const std::size_t channels = std::size_t(frame.channels()), pixels = frame.size() / channels;
    const std::size_t stride = pixels / 50'000 + 1 + (pixels / 50'000) % 2;  // odd: walks through all columns
    std::vector<double> values;
    for (std::size_t i = 0; i < pixels; i += stride)
        values.push_back(brightness(frame.data() + i * channels, frame.channels()));
    std::sort(values.begin(), values.end());
    if (values.empty()) return {};
    Range range{values[values.size() / 100], values[values.size() - 1 - values.size() / 100]};
    if (range.empty()) range = {values.front(), values.back()};  // lamps in the night
    // A constant that does not add up to itself is no contrast.
    if (range.high - range.low < 1e-5 * std::max(std::abs(range.high), std::abs(range.low))) range = {};
    return range;
}

ImageF prepared(const ImageF& frame, const Range& range)
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

/// Levels of half the size each; the first is the picture itself, smoothed. An empty first level: not kept.
using Pyramid = std::vector<ImageF>;

Pyramid pyramidOf(const ImageF& frame, const Range& range)
{
    Pyramid levels;
    levels.push_back(smoothed(prepared(frame, range), 1));
    while (std::min(levels.back().width(), levels.back().height()) >= 2 * topSide)
        levels.push_back(smoothed(levels.back(), 2));
    return levels;
}

/// Keys' cubic, a = -1/2.
std::array<float, 4> cubic(float t)
{
    return {t * (-0.5f + t * (1.0f - 0.5f * t)), 1.0f + t * t * (-2.5f + 1.5f * t), t * (0.5f + t * (2.0f - 1.5f * t)),
            t * t * (-0.5f + 0.5f * t)};
}

/// At a point at least a pixel inside; false elsewhere.
bool sampleInside(const ImageF& picture, double x, double y, float& value)
{
    if (!(x >= 1 && y >= 1 && x < picture.width() - 2 && y < picture.height() - 2)) return false;
    const int x0 = int(x), y0 = int(y);
    const auto wx = cubic(float(x - x0)), wy = cubic(float(y - y0));
    const float* p = picture.row(y0 - 1) + x0 - 1;
    value = 0;
    for (int j = 0; j < 4; ++j, p += picture.width())
        value += wy[std::size_t(j)] * (wx[0] * p[0] + wx[1] * p[1] + wx[2] * p[2] + wx[3] * p[3]);
    return true;
}

// -------------------------------------------------------------------------------------------------------- refinement

/// Directions in which a homography can change, as velocities at normalised (u, v): shift, rotation, scale; two shears;
/// perspective. The first 2, 4, 6, 8 of them are a shift, similarity, affinity and homography.
Matrix3d generator(int i)
{
    Matrix3d g = Matrix3d::Zero();
    switch (i) {
        case 0: g(0, 2) = 1; break;
        case 1: g(1, 2) = 1; break;
        case 2: g(0, 1) = -1, g(1, 0) = 1; break;
        case 3: g(0, 0) = 1, g(1, 1) = 1; break;
        case 4: g(0, 0) = 1, g(1, 1) = -1; break;
        case 5: g(0, 1) = 1, g(1, 0) = 1; break;
        case 6: g(2, 0) = -1; break;
        default: g(2, 1) = -1; break;
    }
    return g;
}

using Velocities = Eigen::Matrix<double, 2, parameters>;
Velocities velocities(double u, double v)
{
    Velocities m;
    m << 1, 0, -v, u, u, v, u * u, u * v,  //
        0, 1, u, v, -v, u, u * v, v * v;
    return m;
}

Vector2d applied(const Matrix3d& h, double u, double v)
{
    const Vector3d p = h * Vector3d(u, v, 1);
    return p.head<2>() / p.z();
}

struct Sample {
    float u, v;                            // normalised
    float value;                           // of the template
    std::array<float, parameters> change;  // of it, a parameter
};

std::uint32_t hashed(std::uint32_t x)
{
    x = (x ^ (x >> 16)) * 0x7FEB352Du;
    x = (x ^ (x >> 15)) * 0x846CA68Bu;
    return x ^ (x >> 16);
}

struct Gradient {
    float x, y;
    float square() const { return x * x + y * y; }
};
Gradient gradientAt(const ImageF& picture, int x, int y)
{
    // Fourth order: two of three points would make a slope of a fine texture's too small.
    const float* p = &picture.at(x, y);
    const std::ptrdiff_t w = picture.width();
    return {(8 * (p[1] - p[-1]) - (p[2] - p[-2])) / 12, (8 * (p[w] - p[-w]) - (p[2 * w] - p[-2 * w])) / 12};
}

/// The half of a level's pixels that has most gradient, thinned by a hash.
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
    const Matrix3d normalised = grid.pixels(level).inverse();
    const double scale = grid.pixels(level)(0, 0);
    for (int y = 2; y < height - 2; ++y) {
        for (int x = 2; x < width - 2; ++x) {
            const Gradient g = gradientAt(picture, x, y);
            if (g.square() < least || g.square() <= 0) continue;
            if (hashed(std::uint32_t(y) * std::uint32_t(width) + std::uint32_t(x)) > most) continue;
            const Vector2d at = applied(normalised, x, y);
            const Velocities v = velocities(at.x(), at.y());
            Sample sample{float(at.x()), float(at.y()), picture.at(x, y), {}};
            for (int i = 0; i < parameters; ++i)
                sample.change[std::size_t(i)] = float(scale * (g.x * v(0, i) + g.y * v(1, i)));
            result.push_back(sample);
        }
    }
    return result;
}

/// Where a picture lies: frame from template in normalised coordinates; template = gain * frame + offset.
struct Fit {
    Matrix3d frame = Matrix3d::Identity();
    double gain = 1, offset = 0;
    double sigma = leastScale;                                  // of the residuals, rain and movers left out
    double spread = leastScale;                                 // of all
    double loose_px = std::numeric_limits<double>::infinity();  // standard deviation at the worst corner
};

/// Gauss-Newton on one level in the first `freedom` directions. Nothing if the samples do not determine them.
std::optional<Fit> refined(std::span<const Sample> from, const ImageF& to, const Grid& grid, int level, Fit fit,
                           int freedom, int steps)
{
    if (from.size() < fewestSamples) return std::nullopt;
    const Matrix3d pixels = grid.pixels(level);
    const double aspectU = grid.centreX / grid.scale, aspectV = grid.centreY / grid.scale;
    std::vector<float> values(from.size()), errors, sizes;
    for (int step = 0; step < steps; ++step) {
        const Matrix3d warp = pixels * fit.frame;
        errors.assign(from.size(), std::numeric_limits<float>::infinity());
        sizes.clear();
        for (std::size_t i = 0; i < from.size(); ++i) {
            const Sample& s = from[i];
            const double w = warp(2, 0) * s.u + warp(2, 1) * s.v + warp(2, 2);
            if (!(w > 0.1)) continue;
            const double x = (warp(0, 0) * s.u + warp(0, 1) * s.v + warp(0, 2)) / w;
            const double y = (warp(1, 0) * s.u + warp(1, 1) * s.v + warp(1, 2)) / w;
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

        Matrix3d change = Matrix3d::Identity();
        for (int k = 0; k < freedom; ++k) change += by(k) * generator(k);
        const double determinant = change.determinant();
        if (!(determinant > 0.1 && determinant < 10)) return std::nullopt;
        fit.frame = fit.frame * change.inverse();
        fit.frame /= std::cbrt(std::abs(fit.frame.determinant()));
        fit.gain += by(freedom);
        fit.offset += by(freedom + 1);
        if (!fit.frame.allFinite() || !(fit.gain > 0.1 && fit.gain < 10)) return std::nullopt;

        const Eigen::MatrixXd covariance =
            solver.solve(Eigen::MatrixXd::Identity(size, size)).topLeftCorner(freedom, freedom);
        double moved = 0;
        fit.loose_px = 0;
        for (int corner = 0; corner < 4; ++corner) {
            const Eigen::MatrixXd v =
                pixels(0, 0) *
                velocities(corner % 2 ? aspectU : -aspectU, corner / 2 ? aspectV : -aspectV).leftCols(freedom);
            moved = std::max(moved, (v * by.head(freedom)).norm());
            const double variance = (v * covariance * v.transpose()).trace();
            fit.loose_px = std::max(fit.loose_px, fit.sigma * std::sqrt(correlatedPixels * std::max(0.0, variance)));
        }
        if (moved < steady_px) break;
    }
    return fit;
}

// ----------------------------------------------------------------------------------------------------------- judging

struct Judgement {
    int textured = 0, inliers = 0;
    double share = 0, residual_px = 0;
};

/// Looks for what is left of the displacement in each cell of the template (Lucas and Kanade 1981, with the weights and
/// the brightness of the fit). A cell is an inlier if it is found, is alike, and lies where the fit says.
Judgement judged(const ImageF& from, const ImageF& to, const Grid& grid, int level, const Fit& fit)
{
    Judgement result;
    const int width = from.width(), height = from.height();
    const int cell = std::clamp(std::min(width, height) / 8, 12, 64), stride = cell / 24 + 1;
    const Matrix3d warp = grid.pixels(level) * fit.frame * grid.pixels(level).inverse();
    const float limit = float(biweight * fit.spread);
    struct Point {
        double x, y;
        float value;
        Gradient gradient;
    };
    std::vector<Point> points;
    double squares = 0;
    for (int top = 2; top + cell <= height - 2; top += cell) {
        for (int left = 2; left + cell <= width - 2; left += cell) {
            points.clear();
            double xx = 0, xy = 0, yy = 0;
            bool inside = true;
            for (int y = top; y < top + cell; y += stride) {
                for (int x = left; x < left + cell; x += stride) {
                    const Vector2d at = applied(warp, x, y);
                    inside = inside && at.x() > 2 && at.y() > 2 && at.x() < to.width() - 3 && at.y() < to.height() - 3;
                    const Gradient g = gradientAt(from, x, y);
                    points.push_back({at.x(), at.y(), from.at(x, y), g});
                    xx += g.x * g.x;
                    xy += g.x * g.y;
                    yy += g.y * g.y;
                }
            }
            if (!inside) continue;
            const double weakest = 0.5 * (xx + yy - std::hypot(xx - yy, 2 * xy));
            const double correlated = std::max(1.0, correlatedPixels / (stride * stride));
            if (!(weakest * cellPrecision_px * cellPrecision_px > correlated * fit.sigma * fit.sigma)) continue;
            ++result.textured;

            double dx = 0, dy = 0, likeness = 0, weight = 0;
            bool lost = false;
            for (int step = 0; step < 6 && !lost; ++step) {
                double a = 0, b = 0, c = 0, rx = 0, ry = 0, sw = 0, st = 0, si = 0, stt = 0, sii = 0, sti = 0;
                for (const Point& p : points) {
                    float value;
                    if (!sampleInside(to, p.x + dx, p.y + dy, value)) continue;
                    value = float(fit.gain) * value + float(fit.offset);
                    const float error = value - p.value, t = error / limit;
                    if (!(std::abs(t) < 1)) continue;
                    const double w = double((1 - t * t) * (1 - t * t)), gx = p.gradient.x, gy = p.gradient.y;
                    a += w * gx * gx;
                    b += w * gx * gy;
                    c += w * gy * gy;
                    rx += w * gx * error;
                    ry += w * gy * error;
                    sw += w;
                    st += w * p.value;
                    si += w * value;
                    stt += w * p.value * p.value;
                    sii += w * value * value;
                    sti += w * p.value * value;
                }
                const double determinant = a * c - b * b;
                lost = !(determinant > 1e-6 * a * c) || std::hypot(dx, dy) > 3 * inlierDistance_px;
                if (lost) break;
                const double stepX = (c * rx - b * ry) / determinant, stepY = (a * ry - b * rx) / determinant;
                dx -= stepX;
                dy -= stepY;
                weight = sw / double(points.size());
                likeness =
                    (sw * sti - st * si) / std::sqrt(std::max(1e-30, (sw * stt - st * st) * (sw * sii - si * si)));
                if (std::hypot(stepX, stepY) < 0.01) break;
            }
            if (lost || weight < 0.4 || likeness < cellLikeness || std::hypot(dx, dy) > inlierDistance_px) continue;
            ++result.inliers;
            squares += dx * dx + dy * dy;
        }
    }
    if (result.textured > 0) result.share = double(result.inliers) / result.textured;
    if (result.inliers > 0) result.residual_px = std::ldexp(std::sqrt(squares / result.inliers), level);
    return result;
}

// ----------------------------------------------------------------------------------------------------------- features

struct Features {
    std::vector<Vector2d> places;  // normalised
    cv::Mat descriptors;
};

Features featuresOf(const Pyramid& pyramid, const Grid& grid, int level, int most)
{
    const ImageF& picture = pyramid[std::size_t(level)];
    cv::Mat coded(picture.height(), picture.width(), CV_8U);
    for (int y = 0; y < picture.height(); ++y)
        for (int x = 0; x < picture.width(); ++x)
            coded.at<unsigned char>(y, x) =
                static_cast<unsigned char>(std::lround(255 * std::sqrt(std::clamp(picture.at(x, y), 0.0f, 1.0f))));
    std::vector<cv::KeyPoint> points;
    Features features;
    const auto sift = cv::SIFT::create(most, 3, 0.02);
    sift->detectAndCompute(coded, cv::noArray(), points, features.descriptors);
    const Matrix3d normalised = grid.pixels(level).inverse();
    for (const cv::KeyPoint& point : points)
        features.places.push_back(applied(normalised, double(point.pt.x), double(point.pt.y)));
    return features;
}

struct Match {
    Vector2d from, to;
};

/// Descriptors that are clearly nearer to each other than to the second (Lowe 2004, section 7.1), either way.
std::vector<Match> matchesOf(const Features& from, const Features& to)
{
    std::vector<Match> result;
    if (from.places.size() < fewestMatches || to.places.size() < fewestMatches) return result;
    const cv::BFMatcher matcher(cv::NORM_L2);
    std::vector<std::vector<cv::DMatch>> forward;
    std::vector<cv::DMatch> back;
    matcher.knnMatch(from.descriptors, to.descriptors, forward, 2);
    matcher.match(to.descriptors, from.descriptors, back);
    for (const auto& pair : forward) {
        if (pair.size() < 2 || !(pair[0].distance < 0.8f * pair[1].distance)) continue;
        if (back[std::size_t(pair[0].trainIdx)].trainIdx != pair[0].queryIdx) continue;
        result.push_back({from.places[std::size_t(pair[0].queryIdx)], to.places[std::size_t(pair[0].trainIdx)]});
    }
    return result;
}

/// The homography of some matches by least squares of the linear equations (DLT). Coordinates are within about 1
/// already.
std::optional<Matrix3d> homographyOf(std::span<const Match> matches, std::span<const std::size_t> which)
{
    Eigen::Matrix<double, 9, 9> squares = Eigen::Matrix<double, 9, 9>::Zero();
    for (const std::size_t i : which) {
        const Vector2d &p = matches[i].from, &q = matches[i].to;
        Eigen::Matrix<double, 2, 9> rows;
        rows << p.x(), p.y(), 1, 0, 0, 0, -q.x() * p.x(), -q.x() * p.y(), -q.x(),  //
            0, 0, 0, p.x(), p.y(), 1, -q.y() * p.x(), -q.y() * p.y(), -q.y();
        squares += rows.transpose() * rows;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> solver(squares);
    const Eigen::Matrix<double, 9, 1> h = solver.eigenvectors().col(0);
    Matrix3d m;
    m << h(0), h(1), h(2), h(3), h(4), h(5), h(6), h(7), h(8);
    if (!m.allFinite() || std::abs(m(2, 2)) < 1e-3) return std::nullopt;
    return m / m(2, 2);
}

/// The similarity of two or more matches.
std::optional<Matrix3d> similarityOf(std::span<const Match> matches, std::span<const std::size_t> which)
{
    Vector2d from = Vector2d::Zero(), to = Vector2d::Zero();
    for (const std::size_t i : which) from += matches[i].from, to += matches[i].to;
    from /= double(which.size());
    to /= double(which.size());
    double cosine = 0, sine = 0, squares = 0;
    for (const std::size_t i : which) {
        const Vector2d p = matches[i].from - from, q = matches[i].to - to;
        cosine += p.dot(q);
        sine += p.x() * q.y() - p.y() * q.x();
        squares += p.squaredNorm();
    }
    if (!(squares > 1e-6)) return std::nullopt;
    const double c = cosine / squares, s = sine / squares;
    Matrix3d m;
    m << c, -s, to.x() - c * from.x() + s * from.y(), s, c, to.y() - s * from.x() - c * from.y(), 0, 0, 1;
    return m;
}

/// A camera that shakes does not zoom by a half nor stand on its head between two frames.
bool isPlausible(const Matrix3d& m)
{
    for (int corner = 0; corner < 4; ++corner) {
        const double u = corner % 2 ? 1 : -1, v = corner / 2 ? 1 : -1;
        const double w = m(2, 0) * u + m(2, 1) * v + m(2, 2);
        if (!(w > 0.5 * m(2, 2))) return false;
        if (!((applied(m, u, v) - Vector2d(u, v)).norm() < 4)) return false;
    }
    const double area = m.topLeftCorner<2, 2>().determinant() / (m(2, 2) * m(2, 2));
    return area > 0.25 && area < 4;
}

/// The least truncated squares (MSAC) over similarities of two matches and homographies of four, then least squares
/// over what it explains. Nothing if that is too little.
std::optional<Matrix3d> coarse(const Features& from, const Features& to, double tolerance)
{
    const std::vector<Match> matches = matchesOf(from, to);
    if (matches.size() < fewestMatches) return std::nullopt;
    const double limit = tolerance * tolerance;
    Matrix3d best = Matrix3d::Identity();
    double least = std::numeric_limits<double>::infinity();
    const auto attempt = [&](const std::optional<Matrix3d>& m) {
        if (!m || !isPlausible(*m)) return;
        double cost = 0;
        for (const Match& match : matches) {
            cost += std::min(limit, (applied(*m, match.from.x(), match.from.y()) - match.to).squaredNorm());
            if (cost >= least) return;
        }
        least = cost;
        best = *m;
    };
    const auto explained = [&](double within) {
        std::vector<std::size_t> which;
        for (std::size_t i = 0; i < matches.size(); ++i)
            if ((applied(best, matches[i].from.x(), matches[i].from.y()) - matches[i].to).squaredNorm() < within)
                which.push_back(i);
        return which;
    };
    attempt(best);
    std::uint32_t drawn = 0;
    const auto draw = [&] { return std::size_t(hashed(++drawn) % matches.size()); };
    for (int k = 0; k < 300; ++k) {
        const std::array<std::size_t, 2> pair = {draw(), draw()};
        if ((matches[pair[0]].from - matches[pair[1]].from).norm() > 0.1) attempt(similarityOf(matches, pair));
    }
    for (int k = 0; k < 400; ++k) {
        const std::array<std::size_t, 4> four = {draw(), draw(), draw(), draw()};
        attempt(homographyOf(matches, four));
    }
    // A similarity of two near matches explains the far ones badly: wider at first.
    for (const double factor : {9.0, 4.0, 1.0, 1.0}) {
        const std::vector<std::size_t> which = explained(factor * limit);
        if (which.size() >= fewestMatches) attempt(similarityOf(matches, which));
        if (which.size() >= 2 * fewestMatches) attempt(homographyOf(matches, which));
    }
    if (explained(limit).size() < fewestMatches) return std::nullopt;
    return best;
}

// ---------------------------------------------------------------------------------------------------------- alignment

struct Placement {
    Fit fit;
    Judgement judgement;
};

/// A frame that others are aligned to.
struct Template {
    Pyramid pyramid;
    std::vector<std::vector<Sample>> samples;  // a level
};

Template templateOf(Pyramid pyramid, const Grid& grid, int lowest)
{
    Template result{std::move(pyramid), {}};
    result.samples.resize(result.pyramid.size());
    for (std::size_t l = std::size_t(lowest); l < result.samples.size(); ++l)
        result.samples[l] = samplesOf(result.pyramid[l], grid, int(l));
    return result;
}

/// From a guess through the levels first..last of the pyramids. Fewer parameters where the texture does not determine
/// eight of them, or where the level is too small to.
std::optional<Placement> place(const Template& from, const Pyramid& to, const Grid& grid, const Matrix3d& guess,
                               int first, int last)
{
    for (int freedom = parameters; freedom >= 2; freedom -= 2) {
        Fit fit;
        fit.frame = guess;
        if (freedom < parameters) {
            // What the guess says of the rest is no better determined.
            std::vector<Match> matches;
            std::vector<std::size_t> all;
            const auto& samples = from.samples[std::size_t(last)];
            for (std::size_t i = 0; i < samples.size(); i += samples.size() / 500 + 1) {
                all.push_back(matches.size());
                matches.push_back({Vector2d(double(samples[i].u), double(samples[i].v)),
                                   applied(guess, double(samples[i].u), double(samples[i].v))});
            }
            if (all.empty()) return std::nullopt;
            if (const auto similarity = similarityOf(matches, all)) fit.frame = *similarity;
        }
        bool holds = true;
        for (int level = first; level >= last && holds; --level) {
            const ImageF& picture = to[std::size_t(level)];
            const int side = std::min(picture.width(), picture.height());
            std::vector<int> stages;
            if (level == first && first > last) stages = {2, 4};
            stages.push_back(level == last || side >= 100 ? freedom : side >= 50 ? 6 : 4);
            for (const int stage : stages) {
                const auto better = refined(from.samples[std::size_t(level)], picture, grid, level, fit,
                                            std::min(stage, freedom), level == last ? 20 : 10);
                if (better) fit = *better;
                holds = better.has_value() || level > last;
            }
        }
        if (!holds || !isPlausible(fit.frame)) continue;
        if (!(fit.loose_px < loosest_px)) continue;
        return Placement{fit, judged(from.pyramid[std::size_t(last)], to[std::size_t(last)], grid, last, fit)};
    }
    return std::nullopt;
}

/// Share of the template's area that lies inside the frame.
double overlapOf(const Matrix3d& frame, const Grid& grid)
{
    const double u = grid.centreX / grid.scale, v = grid.centreY / grid.scale;
    int inside = 0;
    for (int y = 0; y < 16; ++y) {
        for (int x = 0; x < 16; ++x) {
            const Vector2d at = applied(frame, u * ((x + 0.5) / 8 - 1), v * ((y + 0.5) / 8 - 1));
            inside += std::abs(at.x()) <= u && std::abs(at.y()) <= v;
        }
    }
    return inside / 256.0;
}

/// All that is known while frames are aligned. Frames are by number; transforms are frame from reference, normalised.
class Alignment {
public:
    Alignment(std::span<const ImageF> frames, std::size_t reference, const AlignmentOptions& options,
              const Range& range);

    void chain();          ///< each frame to its neighbour on the side of the reference, roughly
    void chooseAnchors();  ///< what each is refined against
    void refine();         ///< on the pixels of the frames, against their anchors
    void polish();         ///< once more, against pictures that have no rain of their own
    std::vector<FrameAlignment> result() const;

private:
    bool isGood(const std::optional<Placement>& p) const
    {
        return p && p->judgement.inliers >= fewestInliers && p->judgement.share >= options_.minInlierShare;
    }
    std::size_t inwards(std::size_t k) const { return k > reference_ ? k - 1 : k + 1; }
    ImageF base(std::size_t k) const { return smoothed(prepared(frames_[k], range_), 1); }
    Pyramid whole(std::size_t k) const
    {
        Pyramid pyramid = pyramids_[k];
        if (pyramid[0].empty()) pyramid[0] = base(k);
        return pyramid;
    }
    /// The body for each of some frames, on all cores.
    static void each(std::span<const std::size_t> which, const std::function<void(std::size_t)>& body)
    {
        parallelFor(0, std::ptrdiff_t(which.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (std::ptrdiff_t i = first; i < last; ++i) body(which[std::size_t(i)]);
        });
    }

    std::optional<Placement> link(const Template& from, std::size_t a, std::size_t b) const;
    void refine(std::size_t k, const Template& anchor);
    void refineElsewhere(std::size_t k);
    void polish(std::size_t anchor, std::span<const std::optional<Matrix3d>> before);
    class Neighbourhood;

    std::span<const ImageF> frames_;
    std::size_t reference_;
    AlignmentOptions options_;
    Range range_;
    Grid grid_;
    int featureLevel_ = 0, top_ = 0, lowest_ = 0;  // levels: of the features, the smallest, the largest that is kept
    std::vector<std::size_t> outwards_;  // all but the reference; those nearer to it on the same side come before
    std::vector<Pyramid> pyramids_;
    std::vector<Features> features_;
    std::vector<std::optional<Matrix3d>> chained_, placed_;  // roughly, and exactly
    std::vector<std::size_t> anchors_;
    std::vector<Judgement> judgements_;  // against the anchors
};

Alignment::Alignment(std::span<const ImageF> frames, std::size_t reference, const AlignmentOptions& options,
                     const Range& range)
    : frames_(frames), reference_(reference), options_(options), range_(range),
      grid_(frames[0].width(), frames[0].height()), pyramids_(frames.size()), features_(frames.size()),
      chained_(frames.size()), placed_(frames.size()), anchors_(frames.size(), reference), judgements_(frames.size())
{
    for (std::size_t k = reference + 1; k < frames.size(); ++k) outwards_.push_back(k);
    for (std::size_t k = reference; k-- > 0;) outwards_.push_back(k);
    chained_[reference] = placed_[reference] = Matrix3d::Identity();
    judgements_[reference].share = 1;

    int side = std::min(frames[0].width(), frames[0].height());
    for (; side >= 2 * topSide; side = (side + 1) / 2) ++top_;
    lowest_ = std::min(1, top_);
    while (featureLevel_ < top_ && std::max(frames[0].width(), frames[0].height()) >> featureLevel_ > featureSide)
        ++featureLevel_;
    std::vector<std::size_t> all = outwards_;
    all.push_back(reference);
    each(all, [&](std::size_t k) {
        Pyramid pyramid = pyramidOf(frames_[k], range_);
        features_[k] = featuresOf(pyramid, grid_, featureLevel_, options_.mostFeatures);
        if (lowest_ > 0) pyramid[0] = {};
        pyramids_[k] = std::move(pyramid);
    });
}

/// From a to b by features, and if they fail from where nothing has moved.
std::optional<Placement> Alignment::link(const Template& from, std::size_t a, std::size_t b) const
{
    const double tolerance = matchTolerance_px / grid_.pixels(featureLevel_)(0, 0);
    std::optional<Placement> placed;
    if (const auto guess = coarse(features_[a], features_[b], tolerance))
        placed = place(from, pyramids_[b], grid_, *guess, std::min(top_, 2), lowest_);
    if (isGood(placed)) return placed;
    const auto still = place(from, pyramids_[b], grid_, Matrix3d::Identity(), top_, lowest_);
    return still && (!placed || still->judgement.share > placed->judgement.share) ? still : placed;
}

void Alignment::chain()
{
    std::vector<std::optional<Placement>> links(frames_.size());
    each(outwards_,
         [&](std::size_t k) { links[k] = link(templateOf(pyramids_[inwards(k)], grid_, lowest_), inwards(k), k); });
    for (const std::size_t k : outwards_) {
        std::size_t nearest = inwards(k);
        if (isGood(links[k]) && chained_[nearest]) {
            chained_[k] = links[k]->fit.frame * *chained_[nearest];
            continue;
        }
        // Past a frame that was lost: the nearest that was not, and the reference itself.
        while (!chained_[nearest]) nearest = inwards(nearest);
        for (const std::size_t a : {nearest, reference_}) {
            const auto past = link(templateOf(pyramids_[a], grid_, lowest_), a, k);
            if (!isGood(past)) continue;
            chained_[k] = past->fit.frame * *chained_[a];
            break;
        }
    }
}

void Alignment::chooseAnchors()
{
    for (const bool after : {true, false}) {
        std::size_t anchor = reference_, previous = reference_;
        for (const std::size_t k : outwards_) {
            if ((k > reference_) != after || !chained_[k]) continue;
            if (overlapOf(*chained_[k] * chained_[anchor]->inverse(), grid_) < options_.minOverlap) anchor = previous;
            anchors_[k] = anchor;
            previous = k;
        }
    }
}

void Alignment::refine(std::size_t k, const Template& anchor)
{
    const std::size_t a = anchors_[k];
    const auto p = place(anchor, whole(k), grid_, *chained_[k] * chained_[a]->inverse(), std::min(top_, 2), 0);
    if (!isGood(p)) return;
    placed_[k] = p->fit.frame * *placed_[a];
    judgements_[k] = p->judgement;
}

/// A frame that its anchor does not recognise, against the nearest that has its place.
void Alignment::refineElsewhere(std::size_t k)
{
    std::size_t nearest = inwards(k);
    while (!placed_[nearest]) nearest = inwards(nearest);
    if (nearest == anchors_[k]) return;
    anchors_[k] = nearest;
    refine(k, templateOf(whole(nearest), grid_, 0));
}

void Alignment::refine()
{
    // Anchors first, as they are needed; each has its own before it.
    std::vector<std::optional<Template>> templates(frames_.size());
    templates[reference_] = templateOf(whole(reference_), grid_, 0);
    std::vector<std::size_t> rest;
    const std::vector<std::size_t> anchors = anchors_;
    for (const std::size_t k : outwards_) {
        if (!chained_[k]) continue;
        if (std::find(anchors.begin(), anchors.end(), k) == anchors.end()) {
            rest.push_back(k);
            continue;
        }
        if (templates[anchors_[k]]) refine(k, *templates[anchors_[k]]);
        if (!placed_[k]) refineElsewhere(k);
        if (placed_[k]) templates[k] = templateOf(whole(k), grid_, 0);
    }
    each(rest, [&](std::size_t k) {
        if (templates[anchors_[k]]) refine(k, *templates[anchors_[k]]);
    });
    for (const std::size_t k : rest)
        if (!placed_[k]) refineElsewhere(k);
}

/// The frames nearest to an anchor, itself among them, in its grid: what its picture is without rain.
class Alignment::Neighbourhood {
public:
    Neighbourhood(const Alignment& all, std::size_t anchor, std::span<const std::optional<Matrix3d>> placed)
    {
        for (std::size_t k = 0; k < placed.size(); ++k)
            if (placed[k]) frames_.push_back(k);
        const auto distance = [anchor](std::size_t k) { return k > anchor ? k - anchor : anchor - k; };
        std::stable_sort(frames_.begin(), frames_.end(),
                         [&](std::size_t a, std::size_t b) { return distance(a) < distance(b); });
        if (frames_.size() > medianFrames) frames_.resize(medianFrames);
        std::vector<std::size_t> places(frames_.size());
        std::iota(places.begin(), places.end(), std::size_t(0));
        pictures_.resize(frames_.size());
        const Matrix3d pixels = all.grid_.pixels(0), referenceFromAnchor = placed[anchor]->inverse();
        each(places, [&](std::size_t i) {
            const ImageF picture = all.base(frames_[i]);
            if (frames_[i] == anchor) {
                pictures_[i] = picture;
                return;
            }
            const Matrix3d warp = pixels * *placed[frames_[i]] * referenceFromAnchor * pixels.inverse();
            ImageF warped(picture.width(), picture.height(), 1, std::numeric_limits<float>::quiet_NaN());
            for (int y = 0; y < warped.height(); ++y) {
                for (int x = 0; x < warped.width(); ++x) {
                    const Vector2d at = applied(warp, x, y);
                    sampleInside(picture, at.x(), at.y(), warped.at(x, y));
                }
            }
            pictures_[i] = std::move(warped);
        });
    }

    std::size_t size() const { return frames_.size(); }
    bool contains(std::size_t k) const { return std::find(frames_.begin(), frames_.end(), k) != frames_.end(); }

    /// The median of all but one, if that is among them: a frame that is compared with itself stays where it is.
    ImageF medianWithout(std::size_t k) const
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

private:
    std::vector<std::size_t> frames_;
    std::vector<ImageF> pictures_;  // NaN where they do not reach
};

void Alignment::polish()
{
    const std::vector<std::optional<Matrix3d>> before = placed_;
    polish(reference_, before);
    for (const std::size_t anchor : outwards_) polish(anchor, before);
}

/// The frames of one anchor, whose own place is known by now.
void Alignment::polish(std::size_t anchor, std::span<const std::optional<Matrix3d>> before)
{
    std::vector<std::size_t> members;
    for (const std::size_t k : outwards_)
        if (anchors_[k] == anchor && before[k]) members.push_back(k);
    if (members.empty()) return;
    const Matrix3d referenceFromAnchor = before[anchor]->inverse();
    for (const std::size_t k : members) placed_[k] = *before[k] * referenceFromAnchor * *placed_[anchor];
    const Neighbourhood near(*this, anchor, before);
    if (near.size() < fewestMedianFrames) return;
    const Template common = templateOf({near.medianWithout(frames_.size())}, grid_, 0);
    const auto placedAgain = [&](std::size_t k, const Matrix3d& guess) {
        const Pyramid picture = {base(k)};
        if (!near.contains(k)) return place(common, picture, grid_, guess, 0, 0);
        return place(templateOf({near.medianWithout(k)}, grid_, 0), picture, grid_, guess, 0, 0);
    };
    // The median lies where its frames do on average, which is not quite where the anchor does.
    const auto own = placedAgain(anchor, Matrix3d::Identity());
    if (!isGood(own)) return;
    const Matrix3d medianFromReference = own->fit.frame.inverse() * *placed_[anchor];
    each(members, [&](std::size_t k) {
        const auto p = placedAgain(k, *before[k] * referenceFromAnchor);
        if (!isGood(p)) return;
        placed_[k] = p->fit.frame * medianFromReference;
        judgements_[k] = p->judgement;
    });
}

Homography homographyOf(const Matrix3d& frame, const Grid& grid)
{
    // Normalised -> pixels whose centres are at + 1/2.
    Matrix3d pixels = grid.pixels(0);
    pixels(0, 2) += 0.5;
    pixels(1, 2) += 0.5;
    Matrix3d m = pixels * frame.inverse() * pixels.inverse();
    m /= m(2, 2);
    Homography result;
    for (int i = 0; i < 9; ++i) result.m[std::size_t(i)] = m(i / 3, i % 3);
    return result;
}

std::vector<FrameAlignment> Alignment::result() const
{
    std::vector<FrameAlignment> result(frames_.size());
    result[reference_] = {{}, true, 0, 1, 0};
    const double width = frames_[0].width(), height = frames_[0].height();
    for (const std::size_t k : outwards_) {
        if (!placed_[k]) continue;
        const Homography h = homographyOf(*placed_[k], grid_);
        if (!std::all_of(h.m.begin(), h.m.end(), [](double v) { return std::isfinite(v); })) continue;
        // A frame is no better placed than what it was placed against.
        const FrameAlignment& anchor = result[anchors_[k]];
        FrameAlignment& out = result[k];
        out = {h, true, std::hypot(judgements_[k].residual_px, anchor.residual_px),
               std::min(judgements_[k].share, anchor.inlierShare), 0};
        for (const auto& [x, y] : {std::array{0.0, 0.0}, {width, 0.0}, {0.0, height}, {width, height}}) {
            const auto at = h(x, y);
            out.motion_px = std::max(out.motion_px, std::hypot(at[0] - x, at[1] - y));
        }
    }
    return result;
}

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
                const auto wx = cubic(float(sx - x0)), wy = cubic(float(sy - y0));
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

void check(std::span<const ImageF> frames, int reference, const AlignmentOptions& options)
{
    if (reference < 0 || std::size_t(reference) >= frames.size())
        throw Error(ErrorCode::Internal, "reference frame {}: must be one of the {} frames", reference, frames.size());
    const ImageF& first = frames[0];
    if (first.channels() != 1 && first.channels() != 3)
        throw Error(ErrorCode::Internal, "frames of {} channels: must be 1 or 3", first.channels());
    for (const ImageF& frame : frames) {
        if (frame.width() == first.width() && frame.height() == first.height() && frame.channels() == first.channels())
            continue;
        throw Error(ErrorCode::Internal, "a frame of {} x {} x {}: must be {} x {} x {} like the first", frame.width(),
                    frame.height(), frame.channels(), first.width(), first.height(), first.channels());
    }
    if (options.mostFeatures < int(fewestMatches))
        throw Error(ErrorCode::Internal, "mostFeatures {}: must be at least {}", options.mostFeatures, fewestMatches);
    if (!(options.minOverlap >= 0 && options.minOverlap <= 1))
        throw Error(ErrorCode::Internal, "minOverlap {}: must be 0 to 1", options.minOverlap);
    if (!(options.minInlierShare >= 0 && options.minInlierShare <= 1))
        throw Error(ErrorCode::Internal, "minInlierShare {}: must be 0 to 1", options.minInlierShare);
}

}  // namespace

std::array<double, 2> Homography::operator()(double x, double y) const
{
    const double w = m[6] * x + m[7] * y + m[8];
    return {(m[0] * x + m[1] * y + m[2]) / w, (m[3] * x + m[4] * y + m[5]) / w};
}

Homography Homography::inverse() const
{
    Matrix3d matrix;
    matrix << m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8];
    Matrix3d inverted = matrix.inverse();
    if (!inverted.allFinite()) return {};
    if (inverted(2, 2) > 0) inverted /= inverted(2, 2);
    Homography result;
    for (int i = 0; i < 9; ++i) result.m[std::size_t(i)] = inverted(i / 3, i % 3);
    return result;
}

std::vector<FrameAlignment> alignFrames(std::span<const ImageF> frames, int reference, const AlignmentOptions& options)
{
    check(frames, reference, options);
    const Range range = rangeOf(frames[std::size_t(reference)]);
    if (std::min(frames[0].width(), frames[0].height()) < smallestSide || range.empty()) {
        std::vector<FrameAlignment> nothing(frames.size());
        nothing[std::size_t(reference)] = {{}, true, 0, 1, 0};
        return nothing;
    }
    Alignment alignment(frames, std::size_t(reference), options, range);
    alignment.chain();
    alignment.chooseAnchors();
    alignment.refine();
    for (int round = 0; round < polishes; ++round) alignment.polish();
    return alignment.result();
}

ImageF warpToReference(const ImageF& frame, const Homography& referenceFromFrame, ImageF* covered)
{
    return resampled(frame, referenceFromFrame.inverse(), covered);
}

ImageF warpFromReference(const ImageF& picture, const Homography& referenceFromFrame, ImageF* covered)
{
    return resampled(picture, referenceFromFrame, covered);
}

}  // namespace virga::matte
