// The light that a drop returns, by brute force: every pixel of a panorama times D of the angle to it. What the fast
// way (harmonics, lights taken out, baked maps) is measured against; shares nothing with it but the law of D's
// energies.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <numbers>
#include <span>
#include <vector>

#include "core/Image.h"
#include "core/Parallel.h"
#include "optics/DropTransfer.h"

namespace virga::test {

/// L(v) = sum over pixels of radiance, solid angle and the mean of D over the pixel. Each pixel is a patch of one
/// value, cut into split x split parts; over a part D is averaged along theta by half the part's height to either side.
class DropIntegral {
public:
    static constexpr double pi = std::numbers::pi;
    static constexpr int bins = 4320;   // D's energies are exact in steps of 1/24 degree
    static constexpr int terms = 60;    // encounters; 7e-7 of the light is left
    static constexpr int steps = 8192;  // of the table of D, see lookup()

    /// For panoramas of one size.
    DropIntegral(int width, int height, int split, const std::array<double, 3>& index)
        : width_(width), height_(height), split_(split), table_(2 * steps + 2)
    {
        std::vector<double> edges(bins + 1);
        for (int i = 0; i <= bins; ++i) edges[std::size_t(i)] = pi * i / bins;
        const double half = 0.5 * pi / (double(height) * split);
        parallelFor(0, 3, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (std::ptrdiff_t c = first; c < last; ++c) {
                const auto energy = optics::binEnergies(edges, {.index = index[std::size_t(c)], .terms = terms});
                std::vector<double> within(bins + 1, 0.0);
                double left = 1.0;
                for (const double e : energy) left -= e;
                for (std::size_t i = 0; i < bins; ++i) {
                    // What the terms leave goes anywhere.
                    const double share = 0.5 * (std::cos(edges[i]) - std::cos(edges[i + 1]));
                    within[i + 1] = within[i] + energy[i] + left * share;
                }
                const auto upTo = [&](double theta) {
                    const double place = std::clamp(theta / pi, 0.0, 1.0) * bins;
                    const auto i = std::min(std::size_t(place), std::size_t(bins - 1));
                    const double t =
                        (std::cos(edges[i]) - std::cos(theta)) / (std::cos(edges[i]) - std::cos(edges[i + 1]));
                    return within[i] + std::clamp(t, 0.0, 1.0) * (within[i + 1] - within[i]);
                };
                for (int i = 0; i <= 2 * steps; ++i) {
                    const double theta = angleOf(i);
                    const double a = std::max(theta - half, 0.0), b = std::min(theta + half, pi);
                    table_[std::size_t(i)][int(c)] =
                        float((upTo(b) - upTo(a)) / (2 * pi * (std::cos(a) - std::cos(b))));
                }
            }
        });
        table_.back() = table_[table_.size() - 2];
        for (int y = 0; y < height * split; ++y) {
            const double step = pi / (double(height) * split);
            const double area = 2 * pi / (double(width) * split) * (std::cos(y * step) - std::cos((y + 1) * step));
            area_.push_back(area);
            sine_.push_back(std::sin((y + 0.5) * step));
            cosine_.push_back(std::cos((y + 0.5) * step));
        }
        for (int x = 0; x < width * split; ++x) {
            const double azimuth = 2 * pi * ((x + 0.5) / (double(width) * split) - 0.5);
            east_.push_back(float(std::sin(azimuth)));
            ahead_.push_back(float(std::cos(azimuth)));
        }
    }

    glm::dvec3 operator()(ConstImageViewF panorama, const glm::dvec3& direction) const
    {
        assert(panorama.width() == width_ && panorama.height() == height_);
        const glm::dvec3 v = glm::normalize(direction);
        glm::dvec3 sum(0.0);
        for (std::size_t y = 0; y < area_.size(); ++y) {
            const float* row = panorama.row(int(y) / split_);
            const float up = float(v.y * cosine_[y]), a = float(v.x * sine_[y]), b = float(-v.z * sine_[y]);
            glm::vec3 part(0.0f);
            for (std::size_t x = 0; x < east_.size(); ++x) {
                const float* p = row + x / std::size_t(split_) * std::size_t(panorama.channels());
                part += lookup(up + a * east_[x] + b * ahead_[x]) * glm::vec3(p[0], p[1], p[2]);
            }
            sum += area_[y] * glm::dvec3(part);
        }
        return sum;
    }

    /// All at once, on all cores.
    std::vector<glm::dvec3> operator()(ConstImageViewF panorama, std::span<const glm::dvec3> directions) const
    {
        std::vector<glm::dvec3> result(directions.size());
        parallelFor(0, std::ptrdiff_t(directions.size()), 4, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (std::ptrdiff_t i = first; i < last; ++i) {
                result[std::size_t(i)] = (*this)(panorama, directions[std::size_t(i)]);
            }
        });
        return result;
    }

private:
    // Entries lie in equal steps of the chord 2 sin(theta / 2), from 0 forward to half-way, then the same from behind.
    static double angleOf(int i)
    {
        const double chord = double(i <= steps ? i : 2 * steps - i) / steps * std::sqrt(0.5);
        return i <= steps ? 2 * std::asin(chord) : pi - 2 * std::asin(chord);
    }
    const glm::vec3& lookup(float cosine) const
    {
        const float chord = std::sqrt(std::max(0.0f, 1.0f - std::abs(cosine))) * float(steps);
        const int i = int(chord + 0.5f);
        return table_[std::size_t(cosine >= 0.0f ? i : 2 * steps - i)];
    }

    int width_, height_, split_;
    std::vector<glm::vec3> table_;
    std::vector<double> area_, sine_, cosine_;
    std::vector<float> east_, ahead_;
};

}  // namespace virga::test
