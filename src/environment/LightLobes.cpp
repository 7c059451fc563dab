#include "environment/LightLobes.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>

#include "core/Parallel.h"

namespace virga::environment {
namespace {

constexpr double pi = std::numbers::pi;

/// Steps of a sixteenth of a degree in which D's energies are exact; a quarter of a degree would show at rainbows.
constexpr int bins = 2880;

/// Half widths at which blurError() is tabulated: two to an octave.
constexpr int errorSteps = 17;
double errorWidth(int i) { return LightLobes::sharpest * std::exp2(0.5 * i); }

/// D averaged over rings of one half width, by table: for all pixels that meet a light. Equal steps of the chord from
/// the light, then of the chord to its opposite: a square root finds the place, and steps are under 1/50 degree
/// everywhere, a fraction of what the map blurs, so that the nearest entry will do.
class LobeTable {
public:
    LobeTable(const LightLobes& lobes, double halfWidth) : value_(2 * half + 1)
    {
        for (int i = 0; i <= 2 * half; ++i) {
            const double chord = double(i <= half ? i : 2 * half - i) / half * std::sqrt(0.5);
            const double angle = 2.0 * std::asin(chord);
            value_[std::size_t(i)] = glm::vec4(lobes.mean(i <= half ? angle : pi - angle, halfWidth), 0.0f);
        }
    }
    const glm::vec4& operator()(float cosine) const
    {
        const float chord = std::sqrt(std::max(0.0f, 1.0f - std::abs(cosine)));
        const float place = chord * float(half) + 0.5f;  // its whole part is the nearest entry
        const int i = int(place);
        return value_[std::size_t(cosine >= 0.0f ? i : 2 * half - i)];
    }

private:
    static constexpr int half = 4096;
    std::vector<glm::vec4> value_;
};

}  // namespace

LightLobes::LightLobes(const std::array<optics::DropTransferOptions, 3>& transfer)
{
    std::vector<double> edges(bins + 1);
    for (int i = 0; i <= bins; ++i) edges[std::size_t(i)] = pi * i / bins;
    within_.assign(edges.size(), glm::dvec3(0.0));
    parallelFor(0, 3, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int c = int(first); c < int(last); ++c) {
            optics::DropTransferOptions options = transfer[std::size_t(c)];
            const bool sumsAll = options.terms == 0;
            if (sumsAll) options.terms = 12;
            const std::vector<double> energy = optics::binEnergies(edges, options);
            const double left = sumsAll ? 1.0 - std::accumulate(energy.begin(), energy.end(), 0.0) : 0.0;
            for (std::size_t i = 0; i < energy.size(); ++i) {
                // What later encounters let out, 8.5e-5 of the light, goes anywhere.
                const double anywhere = 0.5 * left * (std::cos(edges[i]) - std::cos(edges[i + 1]));
                within_[i + 1][c] = within_[i][c] + energy[i] + anywhere;
            }
        }
    });

    constexpr int angles = 2880;
    std::vector<double> sharp(angles);
    for (int i = 0; i < angles; ++i) sharp[std::size_t(i)] = mean(pi * (i + 0.5) / angles, sharpest).g;
    for (int step = 0; step < errorSteps; ++step) {
        double square = 0.0;
        for (int i = 0; i < angles; ++i) {
            const double theta = pi * (i + 0.5) / angles;
            const double difference = mean(theta, errorWidth(step)).g - sharp[std::size_t(i)];
            square += difference * difference * 0.5 * std::sin(theta) * pi / angles;
        }
        blurError_.push_back(std::sqrt(square));
    }
}

double LightLobes::halfWidth(const Light& light, double blur)
{
    return std::max(std::hypot(std::sqrt(1.5) * light.radius, blur), sharpest);
}

glm::dvec3 LightLobes::mean(double theta, double halfWidth) const
{
    const double from = std::max(theta - halfWidth, 0.0), to = std::min(theta + halfWidth, pi);
    const double cosFrom = std::cos(from), cosTo = std::cos(to);
    // Between the table's angles the energy goes as the solid angle, that is, D is constant.
    const auto within = [&](double angle, double cosine) {
        const auto i = std::min(std::size_t(angle / pi * bins), std::size_t(bins - 1));
        const double a = std::cos(pi * double(i) / bins), b = std::cos(pi * double(i + 1) / bins);
        return within_[i] + std::clamp((a - cosine) / (a - b), 0.0, 1.0) * (within_[i + 1] - within_[i]);
    };
    return (within(to, cosTo) - within(from, cosFrom)) / (2.0 * pi * (cosFrom - cosTo));
}

double LightLobes::blurError(double halfWidth) const
{
    const double place = std::clamp(2.0 * std::log2(halfWidth / sharpest), 0.0, double(errorSteps - 1));
    const auto i = std::min(std::size_t(place), std::size_t(errorSteps - 2));
    const double t = place - double(i);
    return (1.0 - t) * blurError_[i] + t * blurError_[i + 1];
}

void LightLobes::add(ImageF& map, std::span<const Light> lights) const
{
    if (lights.empty()) return;
    const int width = map.width(), height = map.height();
    const double blur = pi / width;  // half a pixel

    // One table for all lights of about one extent: 32 steps to an octave.
    const auto step = [&](const Light& light) { return int(std::lround(32.0 * std::log2(halfWidth(light, blur)))); };
    std::map<int, std::optional<LobeTable>> tables;
    for (const Light& light : lights) tables.try_emplace(step(light));
    std::vector<std::pair<int, std::optional<LobeTable>*>> wanted;
    for (auto& [key, table] : tables) wanted.emplace_back(key, &table);
    parallelFor(0, std::ptrdiff_t(wanted.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (std::ptrdiff_t i = first; i < last; ++i) {
            wanted[std::size_t(i)].second->emplace(*this, std::exp2(wanted[std::size_t(i)].first / 32.0));
        }
    });
    struct Source {
        const LobeTable* lobe;
        glm::vec4 energy;
        glm::dvec3 direction;
    };
    std::vector<Source> sources;
    sources.reserve(lights.size());
    for (const Light& light : lights) {
        sources.push_back({&*tables.at(step(light)), glm::vec4(light.energy, 0.0f), light.direction});
    }

    std::vector<float> east(static_cast<std::size_t>(width)), ahead(static_cast<std::size_t>(width));
    for (int x = 0; x < width; ++x) {
        const double azimuth = ((x + 0.5) / width - 0.5) * 2.0 * pi;
        east[std::size_t(x)] = float(std::sin(azimuth));
        ahead[std::size_t(x)] = float(std::cos(azimuth));
    }
    parallelFor(0, height, 4, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        std::vector<glm::vec4> sum(static_cast<std::size_t>(width));
        for (int y = int(first); y < int(last); ++y) {
            const double t = (y + 0.5) / height * pi;
            std::fill(sum.begin(), sum.end(), glm::vec4(0.0f));
            for (const Source& source : sources) {
                const float up = float(source.direction.y * std::cos(t));
                const float a = float(source.direction.x * std::sin(t)), b = float(-source.direction.z * std::sin(t));
                for (std::size_t x = 0; x < sum.size(); ++x) {
                    sum[x] += source.energy * (*source.lobe)(up + a * east[x] + b * ahead[x]);
                }
            }
            for (int x = 0; x < width; ++x) {
                for (int c = 0; c < 3; ++c) map.at(x, y, c) += sum[std::size_t(x)][c];
            }
        }
    });
}

}  // namespace virga::environment
