#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <numbers>

#include "core/Error.h"
#include "core/Parallel.h"
#include "environment/Panorama.h"
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
    int columns, rows;
    std::vector<glm::dvec3> color;

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
    Cells cells{std::min(48, width), 1, {}};
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
    return cells;
}

/// Where the frame's edges are and what lies in it.
struct Frame {
    double tanX, tanY;  // half of the frame at distance 1
    double halfAngle;   // [rad], azimuth of the side edges

    glm::dvec3 inCamera(double u, double v) const
    {
        return glm::normalize(glm::dvec3((2.0 * u - 1.0) * tanX, (1.0 - 2.0 * v) * tanY, -1.0));
    }
};

/// What the plate's cells say of the scene and of its light, without a step anywhere.
struct Judgement {
    std::vector<double> elevation;  // [rad], of each cell in the world
    double bottom, top;             // the lowest and the highest
    double scene = 0;               // 0 to 1: there is contrast, so something is in the picture
    double sky = 0;                 // luminance that the ground asks of the sky; 0 for no scene or at night

    Judgement(const Cells& cells, const Frame& frame, const glm::dmat3& worldFromCamera) : elevation(cells.color.size())
    {
        std::size_t at = 0;
        for (int y = 0; y < cells.rows; ++y) {
            for (int x = 0; x < cells.columns; ++x, ++at) {
                const glm::dvec3 camera = frame.inCamera((x + 0.5) / cells.columns, (y + 0.5) / cells.rows);
                elevation[at] = std::asin(std::clamp((worldFromCamera * camera).y, -1.0, 1.0));
            }
        }
        const auto [lowest, highest] = std::minmax_element(elevation.begin(), elevation.end());
        bottom = *lowest;
        top = *highest;

        const double middle = 0.5 * (bottom + top);
        double mean = 0.0, square = 0.0, logarithm = 0.0, ground = 0.0, weights = 0.0;
        const double count = double(cells.color.size());
        for (std::size_t i = 0; i < cells.color.size(); ++i) {
            const double y = luminance(cells.color[i]);
            mean += y / count;
            square += y * y / count;
            logarithm += std::log(y + 1e-4) / count;
            const double weight = 1.0 - smoothstep(middle - 5.0 * degree, middle + 5.0 * degree, elevation[i]) + 1e-6;
            ground += weight * y;
            weights += weight;
        }
        const double contrast = mean > 0.0 ? std::sqrt(std::max(square - mean * mean, 0.0)) / mean : 0.0;
        scene = smoothstep(0.05, 0.25, contrast);
        const double daylight = scene * smoothstep(std::log(0.01), std::log(0.06), logarithm);
        sky = daylight * std::min(ground / weights / groundToSky, brightestGuess);
    }
};

/// Cells cut off at white were brighter: by half, or, above the horizon, as bright as `sky` if that is more.
void extendWhite(Cells& cells, const Judgement& judgement, double sky)
{
    for (std::size_t i = 0; i < cells.color.size(); ++i) {
        const double y = luminance(cells.color[i]);
        const double clipped = smoothstep(0.75, 0.98, y) * (1.0 - smoothstep(1.02, 1.2, y));
        const double above = smoothstep(0.0, 10.0 * degree, judgement.elevation[i]);
        cells.color[i] *= 1.0 + judgement.scene * clipped * (0.5 + above * std::max(0.0, sky - 1.5));
    }
}

/// The plate's colours over world elevation, continued up to the sky and down to the ground.
class Profile {
public:
    Profile(const Cells& cells, const Judgement& judgement, const PlatePanoramaOptions& options) : table_(steps + 1)
    {
        const std::vector<double>& elevation = judgement.elevation;

        // The plate's colours by degree of elevation, each cell shared between the two nearest.
        std::vector<glm::dvec3> sums(degrees + 1, glm::dvec3(0.0));
        std::vector<double> counts(degrees + 1, 0.0);
        for (std::size_t k = 0; k < elevation.size(); ++k) {
            const double place = (elevation[k] / pi + 0.5) * degrees;
            const std::size_t bin = std::size_t(std::min(place, degrees - 1.0));
            const double t = place - double(bin);
            sums[bin] += (1.0 - t) * cells.color[k];
            counts[bin] += 1.0 - t;
            sums[bin + 1] += t * cells.color[k];
            counts[bin + 1] += t;
        }
        // 4 degrees around the elevation asked for count; where there is nothing, what is nearest.
        for (int i = 0; i <= steps; ++i) {
            const double wanted = std::clamp(-pi / 2 + pi * i / steps, judgement.bottom, judgement.top);
            glm::dvec3 sum(0.0);
            double weights = 0.0;
            for (int k = 0; k <= degrees; ++k) {
                const double distance = (pi * k / degrees - pi / 2 - wanted) / (4.0 * degree);
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

}  // namespace

Panorama panoramaFromPlate(ConstImageViewF plate, double horizontalFov, const glm::dmat3& worldFromCamera,
                           const PlatePanoramaOptions& options)
{
    if (plate.empty() || plate.channels() < 3) {
        throw Error(ErrorCode::InvalidArgument, "a plate of {} x {} pixels and {} channels: there is no light in it",
                    plate.width(), plate.height(), plate.channels());
    }
    if (!(horizontalFov > 0.0 && horizontalFov <= 170.0 * degree * (1 + 1e-12))) {
        throw Error(ErrorCode::InvalidArgument,
                    "horizontal field of view {:.4g} degrees: must be over 0 and at most 170", horizontalFov / degree);
    }
    if (options.width < 16) {
        throw Error(ErrorCode::InvalidArgument, "a panorama {} pixels wide: must be 16 or more", options.width);
    }
    if (options.skyRadiance && !(*options.skyRadiance >= 0.0 && std::isfinite(*options.skyRadiance))) {
        throw Error(ErrorCode::InvalidArgument, "sky radiance {}: must be 0 or more", *options.skyRadiance);
    }
    Cells cells = averagePlate(plate);
    Frame frame{};
    frame.halfAngle = 0.5 * horizontalFov;
    frame.tanX = std::tan(frame.halfAngle);
    frame.tanY = frame.tanX * plate.height() / plate.width();
    const Judgement judgement(cells, frame, worldFromCamera);
    extendWhite(cells, judgement, options.skyRadiance.value_or(judgement.sky));
    const Cells soft = cells.blurred();
    const Profile profile(cells, judgement, options);
    const glm::dmat3 cameraFromWorld = glm::transpose(worldFromCamera);

    const int width = options.width, height = options.width / 2;
    Panorama panorama{ImageF(width, height, 3)};
    std::vector<glm::dvec3> level(static_cast<std::size_t>(width));
    for (int x = 0; x < width; ++x) level[std::size_t(x)] = sh::panoramaDirection(x + 0.5, 0.5 * height, width, height);
    parallelFor(0, height, 4, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y) {
            const double elevation = pi / 2 - pi * (y + 0.5) / height;
            const double up = std::sin(elevation), out = std::cos(elevation);
            const glm::dvec3 background = profile(elevation);
            for (int x = 0; x < width; ++x) {
                const glm::dvec3 side = level[std::size_t(x)];
                const glm::dvec3 camera = cameraFromWorld * glm::dvec3(out * side.x, up, out * side.z);
                // The nearest place in the frame: first sideways, then up or down.
                const double azimuth = std::clamp(std::atan2(camera.x, -camera.z), -frame.halfAngle, frame.halfAngle);
                const double ahead = std::cos(azimuth), aside = std::sin(azimuth);
                const double flat = std::hypot(camera.x, camera.z);
                const double tanLimit = frame.tanY * ahead;
                const double tanElevation =
                    flat > 0.0 ? std::clamp(camera.y / flat, -tanLimit, tanLimit) : std::copysign(tanLimit, camera.y);
                const glm::dvec3 nearest = glm::normalize(glm::dvec3(aside, tanElevation, -ahead));
                // 2 asin(|a - b| / 2), which is exact for small angles.
                const double away = 2.0 * std::asin(std::min(1.0, 0.5 * glm::length(camera - nearest)));

                glm::dvec3 color = background;
                const double nearness = 1.0 - smoothstep(0.0, 60.0 * degree, away);
                if (nearness > 0.0) {
                    const double u = 0.5 + 0.5 * aside / (ahead * frame.tanX);
                    const double v = 0.5 - 0.5 * tanElevation / tanLimit;
                    const double sharpness = 1.0 - smoothstep(0.0, 20.0 * degree, away);
                    glm::dvec3 plateColor = soft.sample(u, v);
                    if (sharpness > 0.0) plateColor = glm::mix(plateColor, cells.sample(u, v), sharpness);
                    color = glm::mix(background, plateColor, nearness);
                }
                for (int c = 0; c < 3; ++c) panorama.pixels.at(x, y, c) = float(color[c]);
            }
        }
    });
    return panorama;
}

}  // namespace virga::environment
