#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <numbers>

#include "core/Error.h"
#include "core/Parallel.h"
#include "environment/Panorama.h"
#include "sh/Harmonics.h"
#include "sh/Panorama.h"

namespace virga::environment {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180.0;

constexpr double groundToSky = 0.09;
constexpr double brightestGuess = 4.0;

double luminance(const glm::dvec3& c) { return 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b; }  // Rec.709

double smoothstep(double from, double to, double x)
{
    const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

/// The plate averaged to a few cells.
struct Cells {
    int columns = 0, rows = 0;
    std::vector<glm::dvec3> color;
    std::vector<double>
        cover;  // 0 to 1: how much of a cell the plate shows; colours of empty ones are the plate's mean

    /// Of the cell at a place; u, v in [0, 1], top left first.
    double coverAt(double u, double v) const
    {
        const int x = std::clamp(int(u * columns), 0, columns - 1), y = std::clamp(int(v * rows), 0, rows - 1);
        return cover[std::size_t(y) * std::size_t(columns) + std::size_t(x)];
    }

    const glm::dvec3& at(int x, int y) const { return color[std::size_t(y) * std::size_t(columns) + std::size_t(x)]; }

    /// Bilinear between the cells' centres; u, v in [0, 1], top left first.
    glm::dvec3 sample(double u, double v) const
    {
        const double x = std::clamp(u * columns - 0.5, 0.0, columns - 1.0);
        const double y = std::clamp(v * rows - 0.5, 0.0, rows - 1.0);
        const int x0 = int(x), y0 = int(y);
        const int x1 = std::min(x0 + 1, columns - 1), y1 = std::min(y0 + 1, rows - 1);
        return glm::mix(glm::mix(at(x0, y0), at(x1, y0), x - x0), glm::mix(at(x0, y1), at(x1, y1), x - x0), y - y0);
    }

    /// A quarter of the frame wide, three times over: nearly a Gaussian.
    Cells blurred() const
    {
        Cells result = *this;
        const auto pass = [&](int dx, int dy, int radius) {
            const Cells source = result;
            for (int y = 0; y < rows; ++y) {
                for (int x = 0; x < columns; ++x) {
                    glm::dvec3 sum(0.0);
                    for (int k = -radius; k <= radius; ++k) {
                        sum += source.at(std::clamp(x + k * dx, 0, columns - 1), std::clamp(y + k * dy, 0, rows - 1));
                    }
                    result.color[std::size_t(y) * std::size_t(columns) + std::size_t(x)] = sum / (2.0 * radius + 1.0);
                }
            }
        };
        for (int i = 0; i < 3; ++i) {
            pass(1, 0, std::max(1, columns / 10));
            pass(0, 1, std::max(1, rows / 10));
        }
        return result;
    }
};

Cells averagePlate(ConstImageViewF plate)
{
    const int width = plate.width(), height = plate.height(), channels = plate.channels();
    Cells cells{std::min(48, width), 1, {}, {}};
    cells.rows = std::clamp(int(std::lround(double(cells.columns) * height / width)), 1, std::min(48, height));
    cells.color.resize(std::size_t(cells.columns) * std::size_t(cells.rows));
    std::vector<double> weight(cells.color.size(), 0.0);

    // A few hundred pixels a cell are enough of an average, and reading memory is what this costs.
    const int skip = std::max(1, height / (10 * cells.rows));
    parallelFor(0, cells.rows, 2, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int j = int(first); j < int(last); ++j) {
            const int y0 = int(std::int64_t(j) * height / cells.rows);
            const int y1 = std::max(y0 + 1, int(std::int64_t(j + 1) * height / cells.rows));
            for (int i = 0; i < cells.columns; ++i) {
                const int x0 = int(std::int64_t(i) * width / cells.columns);
                const int x1 = std::max(x0 + 1, int(std::int64_t(i + 1) * width / cells.columns));
                double sum[3] = {}, alpha = 0.0;
                for (int y = y0; y < y1; y += skip) {
                    const float* pixel = plate.pixel(x0, y);
                    for (int x = x0; x < x1; ++x, pixel += channels) {
                        const float total = pixel[0] + pixel[1] + pixel[2];
                        if (!std::isfinite(total)) continue;
                        for (int c = 0; c < 3; ++c) sum[c] += std::max(pixel[c], 0.0f);
                        alpha += channels >= 4 ? std::clamp(pixel[3], 0.0f, 1.0f) : 1.0f;
                    }
                }
                const std::size_t at = std::size_t(j) * std::size_t(cells.columns) + std::size_t(i);
                const int samples = (x1 - x0) * ((y1 - y0 + skip - 1) / skip);
                cells.color[at] = glm::dvec3(sum[0], sum[1], sum[2]) / double(samples);
                weight[at] = alpha / samples;
            }
        }
    });

    // Unpremultiply; cells without any coverage take the mean of the rest.
    glm::dvec3 total(0.0);
    double coverage = 0.0;
    for (std::size_t i = 0; i < weight.size(); ++i) {
        total += cells.color[i];
        coverage += weight[i];
    }
    constexpr double trace = 1e-4;
    const glm::dvec3 mean = coverage > 0.0 ? total / coverage : glm::dvec3(0.0);
    for (std::size_t i = 0; i < weight.size(); ++i) {
        cells.color[i] = (cells.color[i] + trace * mean) / (weight[i] + trace);
    }
    cells.cover = std::move(weight);
    return cells;
}

/// Where the frame's edges are and what lies in it.
struct Frame {
    double tanX, tanY;  // half of the frame at distance 1
    double halfAngle;   // [rad], azimuth of the side edges

    Frame(ConstImageViewF plate, double horizontalFov)
        : tanX(std::tan(0.5 * horizontalFov)), tanY(tanX * plate.height() / plate.width()),
          halfAngle(0.5 * horizontalFov)
    {
    }

    glm::dvec3 inCamera(double u, double v) const
    {
        return glm::normalize(glm::dvec3((2.0 * u - 1.0) * tanX, (1.0 - 2.0 * v) * tanY, -1.0));
    }

    /// A place in the frame, top left first, and the angle from there to the direction asked for [rad].
    struct Place {
        double u, v, away;
    };

    /// The nearest place to a direction in camera axes: first sideways, then up or down.
    Place nearest(const glm::dvec3& camera) const
    {
        const double azimuth = std::clamp(std::atan2(camera.x, -camera.z), -halfAngle, halfAngle);
        const double ahead = std::cos(azimuth), aside = std::sin(azimuth);
        const double flat = std::hypot(camera.x, camera.z);
        const double tanLimit = tanY * ahead;
        const double tanElevation =
            flat > 0.0 ? std::clamp(camera.y / flat, -tanLimit, tanLimit) : std::copysign(tanLimit, camera.y);
        const glm::dvec3 there = glm::normalize(glm::dvec3(aside, tanElevation, -ahead));
        // 2 asin(|a - b| / 2), which is exact for small angles.
        const double away = 2.0 * std::asin(std::min(1.0, 0.5 * glm::length(camera - there)));
        return {0.5 + 0.5 * aside / (ahead * tanX), 0.5 - 0.5 * tanElevation / tanLimit, away};
    }

    /// 0 at the frame's edge, 1 in its middle.
    static double depth(double u, double v) { return 2.0 * std::max(0.0, std::min({u, 1.0 - u, v, 1.0 - v})); }
};

/// A plate on its way into the panorama.
struct View {
    ConstImageViewF plate;
    glm::dmat3 cameraFromWorld;
    Frame frame;
    Cells cells, soft;
    double gain = 1;                // that evens out exposures
    std::vector<double> elevation;  // [rad], of each cell in the world

    explicit View(const PlateView& view)
        : plate(view.plate), cameraFromWorld(glm::transpose(view.worldFromCamera)),
          frame(view.plate, view.horizontalFov), cells(averagePlate(view.plate)), elevation(cells.color.size())
    {
        std::size_t at = 0;
        for (int y = 0; y < cells.rows; ++y) {
            for (int x = 0; x < cells.columns; ++x, ++at) {
                const glm::dvec3 camera = frame.inCamera((x + 0.5) / cells.columns, (y + 0.5) / cells.rows);
                elevation[at] = std::asin(std::clamp((view.worldFromCamera * camera).y, -1.0, 1.0));
            }
        }
    }

    /// The frame's colour nearest to a direction, the more blurred the farther away it is.
    glm::dvec3 color(const Frame::Place& place) const
    {
        const double sharpness = 1.0 - smoothstep(0.0, 20.0 * degree, place.away);
        const glm::dvec3 blurred = soft.sample(place.u, place.v);
        return sharpness > 0.0 ? glm::mix(blurred, cells.sample(place.u, place.v), sharpness) : blurred;
    }
};

/// What one view shows along a direction, and how much that counts.
struct Vote {
    glm::dvec3 color;
    double weight;
};

/// The weighted median, channel by channel, then the mean of the votes near it. A minority that shows something else
/// is left out, noise is averaged, and nothing jumps where the views agree.
glm::dvec3 verdict(std::span<Vote> votes)
{
    if (votes.size() == 1) return votes.front().color;
    double total = 0.0;
    for (const Vote& vote : votes) total += vote.weight;
    glm::dvec3 median(0.0);
    for (int c = 0; c < 3; ++c) {
        std::sort(votes.begin(), votes.end(), [c](const Vote& a, const Vote& b) {
            return a.color[c] != b.color[c] ? a.color[c] < b.color[c] : a.weight < b.weight;
        });
        double sum = 0.0;
        for (const Vote& vote : votes) {
            sum += vote.weight;
            median[c] = vote.color[c];
            if (sum >= 0.5 * total) break;
        }
    }
    const double near = 0.08 * luminance(median) + 0.005;
    glm::dvec3 sum(0.0);
    double weights = 0.0;
    for (const Vote& vote : votes) {
        const glm::dvec3 apart = glm::abs(vote.color - median);
        const double distance = std::max({apart.r, apart.g, apart.b}) / near;
        const double fall = 1.0 + distance * distance;
        const double weight = vote.weight / (fall * fall);
        sum += weight * vote.color;
        weights += weight;
    }
    return weights > 0.0 ? sum / weights : median;
}

constexpr double edgeWeight = 0.01;          // what a view counts at its edge
constexpr double edgeWidth = 0.12;           // of what shows the plate's own pixels, in half frames
constexpr double fillReach = 60.0 * degree;  // where the frames' colours have given way to the profile

/// The middle of a view is what it shows best.
double insideWeight(double u, double v)
{
    const double middle = smoothstep(0.0, 1.0, Frame::depth(u, v));
    return edgeWeight + middle * middle;
}

/// Gains that make views agree on what they both see: medians of the ratio for each two of them, put together by least
/// squares on the logarithms (Brown and Lowe 2007, 6). Their geometric mean is 1.
void evenOutExposures(std::vector<View>& views)
{
    const Eigen::Index count = Eigen::Index(views.size());
    Eigen::MatrixXd normal = 1e-3 * Eigen::MatrixXd::Identity(count, count);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
    std::vector<double> ratios;
    for (Eigen::Index i = 0; i < count; ++i) {
        const View& a = views[std::size_t(i)];
        const glm::dmat3 worldFromCamera = glm::transpose(a.cameraFromWorld);
        for (Eigen::Index k = 0; k < i; ++k) {
            const View& b = views[std::size_t(k)];
            const glm::dmat3 bFromA = b.cameraFromWorld * worldFromCamera;
            ratios.clear();
            for (int y = 0; y < a.cells.rows; y += 2) {
                for (int x = 0; x < a.cells.columns; x += 2) {
                    const glm::dvec3 camera =
                        bFromA * a.frame.inCamera((x + 0.5) / a.cells.columns, (y + 0.5) / a.cells.rows);
                    const Frame::Place place = b.frame.nearest(camera);
                    if (place.away > 1e-6) continue;
                    const double inA = luminance(a.cells.at(x, y)), inB = luminance(b.cells.sample(place.u, place.v));
                    // Neither noise nor cut off at white.
                    if (std::min(inA, inB) > 0.005 && std::max(inA, inB) < 0.8) ratios.push_back(std::log(inA / inB));
                }
            }
            if (ratios.size() < 12) continue;
            const auto middle = ratios.begin() + std::ptrdiff_t(ratios.size() / 2);
            std::nth_element(ratios.begin(), middle, ratios.end());
            const double weight = double(ratios.size());
            normal(i, i) += weight;
            normal(k, k) += weight;
            normal(i, k) -= weight;
            normal(k, i) -= weight;
            right[i] -= weight * *middle;
            right[k] += weight * *middle;
        }
    }
    const Eigen::VectorXd logarithm = normal.ldlt().solve(right);
    for (std::size_t i = 0; i < views.size(); ++i) {
        views[i].gain = std::exp(logarithm[Eigen::Index(i)] - logarithm.mean());
        for (glm::dvec3& color : views[i].cells.color) color *= views[i].gain;
    }
}

/// Replaces each cell by what the views that see it agree on, before anything is concluded from it.
void voteCells(std::vector<View>& views)
{
    if (views.size() == 1) return;
    std::vector<std::vector<glm::dvec3>> agreed(views.size());
    parallelFor(0, std::ptrdiff_t(views.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        std::vector<Vote> votes;
        for (std::size_t i = std::size_t(first); i < std::size_t(last); ++i) {
            const View& own = views[i];
            const glm::dmat3 worldFromCamera = glm::transpose(own.cameraFromWorld);
            agreed[i].reserve(own.cells.color.size());
            for (int y = 0; y < own.cells.rows; ++y) {
                for (int x = 0; x < own.cells.columns; ++x) {
                    const double u = (x + 0.5) / own.cells.columns, v = (y + 0.5) / own.cells.rows;
                    const glm::dvec3 world = worldFromCamera * own.frame.inCamera(u, v);
                    votes.assign(1, {own.cells.at(x, y), insideWeight(u, v) * (edgeWeight + own.cells.coverAt(u, v))});
                    for (std::size_t k = 0; k < views.size(); ++k) {
                        if (k == i) continue;
                        const Frame::Place place = views[k].frame.nearest(views[k].cameraFromWorld * world);
                        if (place.away > 1e-6) continue;
                        votes.push_back({views[k].cells.sample(place.u, place.v),
                                         insideWeight(place.u, place.v) * views[k].cells.coverAt(place.u, place.v)});
                    }
                    agreed[i].push_back(verdict(votes));
                }
            }
        }
    });
    for (std::size_t i = 0; i < views.size(); ++i) views[i].cells.color = std::move(agreed[i]);
}

/// What the plates' cells say of the scene and of its light, without a step anywhere.
struct Judgement {
    double bottom = pi / 2, top = -pi / 2;  // [rad], elevation of the lowest and of the highest cell
    double scene = 0;                       // 0 to 1: there is contrast, so something is in the picture
    double sky = 0;                         // luminance that the ground asks of the sky; 0 for no scene or at night

    explicit Judgement(std::span<const View> views)
    {
        double count = 0.0;
        for (const View& view : views) {
            const auto [lowest, highest] = std::minmax_element(view.elevation.begin(), view.elevation.end());
            bottom = std::min(bottom, *lowest);
            top = std::max(top, *highest);
            count += double(view.elevation.size());
        }

        const double middle = 0.5 * (bottom + top);
        double mean = 0.0, square = 0.0, logarithm = 0.0, ground = 0.0, weights = 0.0;
        for (const View& view : views) {
            for (std::size_t i = 0; i < view.cells.color.size(); ++i) {
                const double y = luminance(view.cells.color[i]);
                mean += y / count;
                square += y * y / count;
                logarithm += std::log(y + 1e-4) / count;
                const double weight =
                    1.0 - smoothstep(middle - 5.0 * degree, middle + 5.0 * degree, view.elevation[i]) + 1e-6;
                ground += weight * y;
                weights += weight;
            }
        }
        const double contrast = mean > 0.0 ? std::sqrt(std::max(square - mean * mean, 0.0)) / mean : 0.0;
        scene = smoothstep(0.05, 0.25, contrast);
        const double daylight = scene * smoothstep(std::log(0.01), std::log(0.06), logarithm);
        sky = daylight * std::min(ground / weights / groundToSky, brightestGuess);
    }
};

/// What is cut off at white was brighter: by half, or, above the horizon, as bright as `sky` if that is more.
double beyondWhite(double luminance, double elevation, const Judgement& judgement, double sky)
{
    const double clipped = smoothstep(0.75, 0.98, luminance) * (1.0 - smoothstep(1.02, 1.2, luminance));
    if (clipped == 0.0) return 1.0;
    const double above = smoothstep(0.0, 10.0 * degree, elevation);
    return 1.0 + judgement.scene * clipped * (0.5 + above * std::max(0.0, sky - 1.5));
}

/// The plates' colours over world elevation, continued up to the sky and down to the ground.
class Profile {
public:
    /// width  [rad], of the elevations that count
    Profile(std::span<const View> views, const Judgement& judgement, const PlatePanoramaOptions& options, double width)
        : table_(steps + 1)
    {
        // The plates' colours by degree of elevation, each cell shared between the two nearest.
        std::vector<glm::dvec3> sums(degrees + 1, glm::dvec3(0.0));
        std::vector<double> counts(degrees + 1, 0.0);
        for (const View& view : views) {
            for (std::size_t k = 0; k < view.elevation.size(); ++k) {
                const double place = (view.elevation[k] / pi + 0.5) * degrees;
                const std::size_t bin = std::size_t(std::min(place, degrees - 1.0));
                const double t = place - double(bin);
                sums[bin] += (1.0 - t) * view.cells.color[k];
                counts[bin] += 1.0 - t;
                sums[bin + 1] += t * view.cells.color[k];
                counts[bin + 1] += t;
            }
        }
        // What is near the elevation asked for counts; where there is nothing, what is nearest.
        for (int i = 0; i <= steps; ++i) {
            const double wanted = std::clamp(-pi / 2 + pi * i / steps, judgement.bottom, judgement.top);
            glm::dvec3 sum(0.0);
            double weights = 0.0;
            for (int k = 0; k <= degrees; ++k) {
                const double distance = (pi * k / degrees - pi / 2 - wanted) / width;
                const double fall = 1.0 + distance * distance;
                const double weight = 1.0 / (fall * fall * fall);
                sum += weight * sums[std::size_t(k)];
                weights += weight * counts[std::size_t(k)];
            }
            table_[std::size_t(i)] = sum / weights;
        }

        const glm::dvec3 edge = (*this)(judgement.top);
        const glm::dvec3 sky = options.skyRadiance ? glm::dvec3(*options.skyRadiance)
                                                   : edge + std::max(0.0, judgement.sky - luminance(edge));
        const double start = std::max(judgement.top, 0.0);
        for (int i = 0; i <= steps; ++i) {
            const double e = -pi / 2 + pi * i / steps;
            table_[std::size_t(i)] = glm::mix(table_[std::size_t(i)], sky, smoothstep(start, start + 30.0 * degree, e));
        }
    }

    glm::dvec3 operator()(double elevation) const
    {
        const double place = std::clamp((elevation + pi / 2) / pi * steps, 0.0, double(steps));
        const int i = std::min(int(place), steps - 1);
        return glm::mix(table_[std::size_t(i)], table_[std::size_t(i) + 1], place - i);
    }

private:
    static constexpr int steps = 90;
    static constexpr int degrees = 180;
    std::vector<glm::dvec3> table_;
};

/// One view's panorama: averages of the frame, and around it what is nearest in the frame.
ImageF smoothPanorama(const View& view, const Profile& profile, int width)
{
    const int height = width / 2;
    ImageF pixels(width, height, 3);
    std::vector<glm::dvec3> level(static_cast<std::size_t>(width));
    for (int x = 0; x < width; ++x) level[std::size_t(x)] = sh::panoramaDirection(x + 0.5, 0.5 * height, width, height);
    parallelFor(0, height, 4, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y) {
            const double elevation = pi / 2 - pi * (y + 0.5) / height;
            const double up = std::sin(elevation), out = std::cos(elevation);
            const glm::dvec3 background = profile(elevation);
            for (int x = 0; x < width; ++x) {
                const glm::dvec3 side = level[std::size_t(x)];
                const Frame::Place place =
                    view.frame.nearest(view.cameraFromWorld * glm::dvec3(out * side.x, up, out * side.z));
                glm::dvec3 color = background;
                const double nearness = 1.0 - smoothstep(0.0, fillReach, place.away);
                if (nearness > 0.0) color = glm::mix(background, view.color(place), nearness);
                for (int c = 0; c < 3; ++c) pixels.at(x, y, c) = float(color[c]);
            }
        }
    });
    return pixels;
}

/// The same of any number of views: what they agree on where they look, and around it the colours there, spread over
/// the sphere as heat spreads, ever longer with the distance. Heat has no streaks, no seams and no poles. 256 x 128.
ImageF spreadPanorama(std::span<const View> views, const Profile& profile)
{
    constexpr int width = 256, height = 128, order = 63;
    ImageF seen(width, height, 3), cover(width, height, 3), away(width, height, 1);
    parallelFor(0, height, 2, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        std::vector<Vote> votes;
        for (int y = int(first); y < int(last); ++y) {
            for (int x = 0; x < width; ++x) {
                const glm::dvec3 world = sh::panoramaDirection(x + 0.5, y + 0.5, width, height);
                double nearest = pi, weight = 0.0;
                votes.clear();
                for (const View& view : views) {
                    const Frame::Place place = view.frame.nearest(view.cameraFromWorld * world);
                    nearest = std::min(nearest, place.away);
                    if (place.away > 1e-6) continue;
                    const double covered = view.cells.coverAt(place.u, place.v);
                    if (covered == 0.0) continue;
                    votes.push_back({view.cells.sample(place.u, place.v), covered * insideWeight(place.u, place.v)});
                    weight = std::max(
                        weight, covered * (edgeWeight + smoothstep(0.0, edgeWidth, Frame::depth(place.u, place.v))));
                }
                away.at(x, y) = float(nearest);
                std::fill_n(cover.pixel(x, y), 3, float(weight));
                if (votes.empty()) continue;
                const glm::dvec3 color = weight * verdict(votes);
                for (int c = 0; c < 3; ++c) seen.at(x, y, c) = float(color[c]);
            }
        }
    });

    // Standard deviations of the heat's kernel [degrees]; between them the logarithm decides.
    constexpr double spreads[] = {3, 4.5, 7, 10, 15, 22, 33, 50};
    constexpr int steps = int(std::size(spreads));
    const sh::Harmonics seenBands = sh::projectPanorama(seen, order), coverBands = sh::projectPanorama(cover, order);
    std::vector<ImageF> colors(steps), covers(steps);
    parallelFor(0, steps, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (std::size_t i = std::size_t(first); i < std::size_t(last); ++i) {
            const double sigma = spreads[i] * degree;
            std::vector<double> heat(order + 1);
            for (int l = 0; l <= order; ++l) heat[std::size_t(l)] = std::exp(-0.5 * l * (l + 1.0) * sigma * sigma);
            sh::Harmonics color = seenBands, weight = coverBands;
            sh::convolve(color, {heat, heat, heat});
            sh::convolve(weight, {heat, heat, heat});
            colors[i] = sh::bakePanorama(color, width, height);
            covers[i] = sh::bakePanorama(weight, width, height);
        }
    });
    const auto spread = [&](int i, int x, int y) {
        // Where next to nothing has arrived rounding would show; wider kernels bring more.
        while (i + 1 < steps && covers[std::size_t(i)].at(x, y) < 1e-3f) ++i;
        const double weight = std::max(covers[std::size_t(i)].at(x, y), 1e-6f);
        const float* p = colors[std::size_t(i)].pixel(x, y);
        return glm::max(glm::dvec3(p[0], p[1], p[2]) / weight, glm::dvec3(0.0));
    };
    ImageF pixels(width, height, 3);
    for (int y = 0; y < height; ++y) {
        const glm::dvec3 background = profile(pi / 2 - pi * (y + 0.5) / height);
        for (int x = 0; x < width; ++x) {
            const double distance = away.at(x, y);
            const double wanted = std::clamp(spreads[0] + 0.7 * distance / degree, spreads[0], spreads[steps - 1]);
            int i = 0;
            while (i + 2 < steps && spreads[i + 1] < wanted) ++i;
            const double t = std::log(wanted / spreads[i]) / std::log(spreads[i + 1] / spreads[i]);
            glm::dvec3 color = glm::mix(spread(i, x, y), spread(i + 1, x, y), t);
            color = glm::mix(background, color, 1.0 - smoothstep(0.0, fillReach, distance));
            const double weight = cover.at(x, y);
            if (weight > edgeWeight) {
                const float* p = seen.pixel(x, y);
                color = glm::mix(color, glm::dvec3(p[0], p[1], p[2]) / weight, std::min(1.0, weight - edgeWeight));
            }
            for (int c = 0; c < 3; ++c) pixels.at(x, y, c) = float(color[c]);
        }
    }
    return pixels;
}

/// A plate's pixels, straight, averaged over step x step, with alpha.
ImageF reduced(ConstImageViewF plate, int step)
{
    ImageF small((plate.width() + step - 1) / step, (plate.height() + step - 1) / step, 4);
    parallelFor(0, small.height(), 8, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y) {
            for (int x = 0; x < small.width(); ++x) {
                float sum[4] = {}, count = 0;
                for (int j = y * step; j < std::min((y + 1) * step, plate.height()); ++j) {
                    for (int i = x * step; i < std::min((x + 1) * step, plate.width()); ++i) {
                        const float* pixel = plate.pixel(i, j);
                        ++count;
                        if (!std::isfinite(pixel[0] + pixel[1] + pixel[2])) continue;
                        for (int c = 0; c < 3; ++c) sum[c] += std::max(pixel[c], 0.0f);
                        sum[3] += plate.channels() >= 4 ? std::clamp(pixel[3], 0.0f, 1.0f) : 1.0f;
                    }
                }
                if (sum[3] <= 0) continue;
                for (int c = 0; c < 3; ++c) small.at(x, y, c) = sum[c] / sum[3];
                small.at(x, y, 3) = sum[3] / count;
            }
        }
    });
    return small;
}

/// Lays the plates' own pixels over the smooth panorama, which shows through towards the outer edges.
void addDetail(ImageF& panorama, std::span<const View> views, const Judgement& judgement, double sky)
{
    struct Picture {
        const View* view;
        ImageF pixels;
        glm::dvec3 axis;
        double cosCorner;
    };
    const int width = panorama.width(), height = panorama.height();
    std::vector<Picture> pictures;
    for (const View& view : views) {
        const double focal = 0.5 * view.plate.width() / view.frame.tanX;
        const int step = std::max(1, int(focal * 2.0 * pi / width));
        pictures.push_back({&view, reduced(view.plate, step),
                            glm::transpose(view.cameraFromWorld) * glm::dvec3(0.0, 0.0, -1.0),
                            -view.frame.inCamera(0.0, 0.0).z});
    }
    parallelFor(0, height, 4, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        std::vector<Vote> votes;
        for (int y = int(first); y < int(last); ++y) {
            const double elevation = pi / 2 - pi * (y + 0.5) / height;
            for (int x = 0; x < width; ++x) {
                const glm::dvec3 world = sh::panoramaDirection(x + 0.5, y + 0.5, width, height);
                double cover = 0.0;
                votes.clear();
                for (const Picture& picture : pictures) {
                    if (glm::dot(world, picture.axis) < picture.cosCorner) continue;
                    const Frame& frame = picture.view->frame;
                    const glm::dvec3 camera = picture.view->cameraFromWorld * world;
                    const double u = 0.5 - 0.5 * camera.x / (camera.z * frame.tanX);
                    const double v = 0.5 + 0.5 * camera.y / (camera.z * frame.tanY);
                    if (u <= 0.0 || u >= 1.0 || v <= 0.0 || v >= 1.0) continue;

                    const int columns = picture.pixels.width(), rows = picture.pixels.height();
                    const double px = std::clamp(u * columns - 0.5, 0.0, columns - 1.0);
                    const double py = std::clamp(v * rows - 0.5, 0.0, rows - 1.0);
                    const int x0 = int(px), y0 = int(py);
                    const int x1 = std::min(x0 + 1, columns - 1), y1 = std::min(y0 + 1, rows - 1);
                    glm::dvec3 color(0.0);
                    double alpha = 0.0;
                    const auto take = [&](int i, int j, double share) {
                        const float* pixel = picture.pixels.pixel(i, j);
                        share *= pixel[3];
                        color += share * glm::dvec3(pixel[0], pixel[1], pixel[2]);
                        alpha += share;
                    };
                    take(x0, y0, (1.0 - px + x0) * (1.0 - py + y0));
                    take(x1, y0, (px - x0) * (1.0 - py + y0));
                    take(x0, y1, (1.0 - px + x0) * (py - y0));
                    take(x1, y1, (px - x0) * (py - y0));
                    if (alpha <= 0.0) continue;
                    color /= alpha;
                    color *= picture.view->gain * beyondWhite(luminance(color), elevation, judgement, sky);
                    votes.push_back({color, alpha * insideWeight(u, v)});
                    cover = std::max(cover, alpha * smoothstep(0.0, edgeWidth, Frame::depth(u, v)));
                }
                if (cover == 0.0) continue;
                const glm::dvec3 color = verdict(votes);
                for (int c = 0; c < 3; ++c) {
                    float& value = panorama.at(x, y, c);
                    value += float(cover) * (float(color[c]) - value);
                }
            }
        }
    });
}

/// The map at another size, bilinear.
ImageF resized(const ImageF& map, int width, int height)
{
    ImageF result(width, height, 3);
    parallelFor(0, height, 8, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y) {
            const double py = std::clamp((y + 0.5) * map.height() / height - 0.5, 0.0, map.height() - 1.0);
            const int y0 = int(py), y1 = std::min(y0 + 1, map.height() - 1);
            const float b = float(py - y0);
            for (int x = 0; x < width; ++x) {
                const double px = (x + 0.5) * map.width() / width - 0.5 + map.width();
                const int x0 = int(px) % map.width(), x1 = (x0 + 1) % map.width();
                const float a = float(px - std::floor(px));
                for (int c = 0; c < 3; ++c) {
                    const float upper = (1 - a) * map.at(x0, y0, c) + a * map.at(x1, y0, c);
                    const float lower = (1 - a) * map.at(x0, y1, c) + a * map.at(x1, y1, c);
                    result.at(x, y, c) = (1 - b) * upper + b * lower;
                }
            }
        }
    });
    return result;
}

void check(std::span<const PlateView> views, const PlatePanoramaOptions& options)
{
    if (views.empty()) throw Error(ErrorCode::InvalidArgument, "a panorama of 0 views: must be 1 or more");
    for (const PlateView& view : views) {
        if (view.plate.empty() || view.plate.channels() < 3) {
            throw Error(ErrorCode::InvalidArgument,
                        "a plate of {} x {} pixels and {} channels: there is no light in it", view.plate.width(),
                        view.plate.height(), view.plate.channels());
        }
        if (!(view.horizontalFov > 0.0 && view.horizontalFov <= 170.0 * degree * (1 + 1e-12))) {
            throw Error(ErrorCode::InvalidArgument,
                        "horizontal field of view {:.4g} degrees: must be over 0 and at most 170",
                        view.horizontalFov / degree);
        }
    }
    if (options.width < 16) {
        throw Error(ErrorCode::InvalidArgument, "a panorama {} pixels wide: must be 16 or more", options.width);
    }
    if (options.skyRadiance && !(*options.skyRadiance >= 0.0 && std::isfinite(*options.skyRadiance))) {
        throw Error(ErrorCode::InvalidArgument, "sky radiance {}: must be 0 or more", *options.skyRadiance);
    }
}

}  // namespace

Panorama panoramaFromViews(std::span<const PlateView> plates, const PlatePanoramaOptions& options)
{
    check(plates, options);
    std::vector<View> views(plates.begin(), plates.end());
    if (options.evenExposures && views.size() > 1) evenOutExposures(views);
    voteCells(views);
    const Judgement judgement(views);
    const double sky = options.skyRadiance.value_or(judgement.sky);
    for (View& view : views) {
        for (std::size_t i = 0; i < view.cells.color.size(); ++i) {
            glm::dvec3& color = view.cells.color[i];
            color *= beyondWhite(luminance(color) / view.gain, view.elevation[i], judgement, sky);
        }
        if (views.size() == 1) view.soft = view.cells.blurred();
    }
    const bool isQuick = views.size() == 1 && !options.detail;
    const Profile profile(views, judgement, options, (isQuick ? 4.0 : 10.0) * degree);
    if (isQuick) return {smoothPanorama(views.front(), profile, options.width)};
    Panorama panorama{resized(spreadPanorama(views, profile), options.width, options.width / 2)};
    if (options.detail) addDetail(panorama.pixels, views, judgement, sky);
    return panorama;
}

Panorama panoramaFromPlate(ConstImageViewF plate, double horizontalFov, const glm::dmat3& worldFromCamera,
                           const PlatePanoramaOptions& options)
{
    const PlateView view{plate, horizontalFov, worldFromCamera};
    return panoramaFromViews({&view, 1}, options);
}

}  // namespace virga::environment
