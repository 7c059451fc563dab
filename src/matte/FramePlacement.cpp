#include "matte/FramePlacement.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace virga::matte::alignment {
namespace {

constexpr double loosest_px = 0.5;  // standard deviation at the corners that a model may have

}  // namespace

Template templateOf(Pyramid pyramid, const Grid& grid, int lowest)
{
    Template result{std::move(pyramid), {}};
    result.samples.resize(result.pyramid.size());
    for (std::size_t l = std::size_t(lowest); l < result.samples.size(); ++l)
        result.samples[l] = samplesOf(result.pyramid[l], grid, int(l));
    return result;
}

std::optional<Placement> place(const Template& from, const Pyramid& to, const Grid& grid, const PlaneTransform& guess,
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
                const double u = double(samples[i].u), v = double(samples[i].v);
                matches.push_back({{u, v}, guess(u, v)});
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

}  // namespace virga::matte::alignment
