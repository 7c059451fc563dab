#include "reference/DropLight.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "core/Parallel.h"
#include "optics/DropTransfer.h"

namespace virga::reference {
namespace {

constexpr double pi = std::numbers::pi;

/// Angle of an entry of the table. Entries lie in equal steps of the chord 2 sin(theta / 2), from 0 forward to
/// half-way, then the same from behind: D changes fastest at both ends.
double angleOf(int i)
{
    const double chord =
        double(i <= DropLight::steps ? i : 2 * DropLight::steps - i) / DropLight::steps * std::sqrt(0.5);
    return i <= DropLight::steps ? 2 * std::asin(chord) : pi - 2 * std::asin(chord);
}

/// Share of the light that is turned by less than an angle.
class EnergyWithin {
public:
    explicit EnergyWithin(double index) : edges_(DropLight::bins + 1), within_(DropLight::bins + 1, 0.0)
    {
        for (std::size_t i = 0; i < edges_.size(); ++i) edges_[i] = pi * double(i) / DropLight::bins;
        const auto energy = optics::binEnergies(edges_, {.index = index, .terms = DropLight::terms});
        double left = 1.0;
        for (const double e : energy) left -= e;
        for (std::size_t i = 0; i < energy.size(); ++i) {
            const double share = 0.5 * (std::cos(edges_[i]) - std::cos(edges_[i + 1]));
            within_[i + 1] = within_[i] + energy[i] + left * share;
        }
    }
    double operator()(double theta) const
    {
        const double place = std::clamp(theta / pi, 0.0, 1.0) * DropLight::bins;
        const auto i = std::min(std::size_t(place), std::size_t(DropLight::bins - 1));
        const double t = (std::cos(edges_[i]) - std::cos(theta)) / (std::cos(edges_[i]) - std::cos(edges_[i + 1]));
        return within_[i] + std::clamp(t, 0.0, 1.0) * (within_[i + 1] - within_[i]);
    }

private:
    std::vector<double> edges_, within_;
};

}  // namespace

DropLight::DropLight(int width, int height, int split, const std::array<double, 3>& index)
    : width_(width), height_(height), split_(split), table_(2 * steps + 2)
{
    const double half = 0.5 * pi / (double(height) * split);
    parallelFor(0, 3, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (std::ptrdiff_t c = first; c < last; ++c) {
            const EnergyWithin upTo(index[std::size_t(c)]);
            for (int i = 0; i <= 2 * steps; ++i) {
                const double theta = angleOf(i);
                const double a = std::max(theta - half, 0.0), b = std::min(theta + half, pi);
                table_[std::size_t(i)][int(c)] = (upTo(b) - upTo(a)) / (2 * pi * (std::cos(a) - std::cos(b)));
            }
        }
    });
    table_.back() = table_[table_.size() - 2];
    for (int y = 0; y < height * split; ++y) {
        const double step = pi / (double(height) * split);
        area_.push_back(2 * pi / (double(width) * split) * (std::cos(y * step) - std::cos((y + 1) * step)));
        sine_.push_back(std::sin((y + 0.5) * step));
        cosine_.push_back(std::cos((y + 0.5) * step));
    }
    for (int x = 0; x < width * split; ++x) {
        const double azimuth = 2 * pi * ((x + 0.5) / (double(width) * split) - 0.5);
        east_.push_back(std::sin(azimuth));
        ahead_.push_back(std::cos(azimuth));
    }
}

glm::dvec3 DropLight::operator()(ConstImageViewF panorama, const glm::dvec3& direction) const
{
    assert(panorama.width() == width_ && panorama.height() == height_);
    const glm::dvec3 v = glm::normalize(direction);
    glm::dvec3 sum(0.0);
    for (std::size_t y = 0; y < area_.size(); ++y) {
        const float* row = panorama.row(int(y) / split_);
        const double up = v.y * cosine_[y], a = v.x * sine_[y], b = -v.z * sine_[y];
        glm::dvec3 part(0.0);
        for (std::size_t x = 0; x < east_.size(); ++x) {
            const float* p = row + x / std::size_t(split_) * std::size_t(panorama.channels());
            part += lookup(up + a * east_[x] + b * ahead_[x]) * glm::dvec3(p[0], p[1], p[2]);
        }
        sum += area_[y] * part;
    }
    return sum;
}

std::vector<glm::dvec3> DropLight::operator()(ConstImageViewF panorama, std::span<const glm::dvec3> directions) const
{
    std::vector<glm::dvec3> result(directions.size());
    parallelFor(0, std::ptrdiff_t(directions.size()), 4, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (std::ptrdiff_t i = first; i < last; ++i)
            result[std::size_t(i)] = (*this)(panorama, directions[std::size_t(i)]);
    });
    return result;
}

const glm::dvec3& DropLight::lookup(double cosine) const
{
    const double chord = std::sqrt(std::max(0.0, 1.0 - std::abs(cosine))) * steps;
    const int i = int(chord + 0.5);
    return table_[std::size_t(cosine >= 0.0 ? i : 2 * steps - i)];
}

}  // namespace virga::reference
