#include "matte/RainStrokes.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "core/Error.h"
#include "core/Parallel.h"
#include "matte/StrokeMeasure.h"
#include "matte/StrokeRidges.h"

namespace virga::matte {
namespace {

std::vector<RainStroke> strokesIn(const ImageF& given, int frame, const RainStrokeOptions& options)
{
    std::vector<RainStroke> found;
    if (given.empty()) return found;
    const auto isFinite = [](float value) { return std::isfinite(value); };
    const auto values = given.values();
    ImageF repaired;
    if (!std::all_of(values.begin(), values.end(), isFinite)) {
        repaired = given;
        for (float& value : repaired.values())
            if (!isFinite(value)) value = 0;
    }
    const ImageF& alpha = repaired.empty() ? given : repaired;
    const StrokeRidges up = strokeRidges(alpha, options);
    for (const Ridge& ridge : up.ridges)
        for (RainStroke& stroke : measureRidge(alpha, up, ridge, options)) {
            stroke.frame = frame;
            found.push_back(stroke);
        }
    return found;
}

}  // namespace

std::vector<RainStroke> findRainStrokes(std::span<const ImageF> alphas, const RainStrokeOptions& options)
{
    if (!(std::abs(options.slant) <= std::numbers::pi / 2 + 1e-9))
        throw Error(ErrorCode::InvalidArgument, "the slant of the rain is {} rad, not within -pi/2..pi/2",
                    options.slant);
    if (!(options.noise >= 0) || !std::isfinite(options.noise))
        throw Error(ErrorCode::InvalidArgument, "the noise of alpha is {}, not 0 or more", options.noise);
    if (!(options.noiseAlong >= 0) || !std::isfinite(options.noiseAlong))
        throw Error(ErrorCode::InvalidArgument, "the noise of alpha is smooth over {} px, not 0 or more",
                    options.noiseAlong);
    if (!(options.maxWidth >= 1 && options.maxWidth <= 64))
        throw Error(ErrorCode::InvalidArgument, "the widest stroke is {} px, not within 1..64", options.maxWidth);
    for (const ImageF& alpha : alphas)
        if (!alpha.empty() && alpha.channels() != 1)
            throw Error(ErrorCode::Internal, "an alpha has {} channels, not 1", alpha.channels());

    std::vector<std::vector<RainStroke>> found(alphas.size());
    parallelFor(0, std::ptrdiff_t(alphas.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (std::ptrdiff_t k = first; k < last; ++k)
            found[std::size_t(k)] = strokesIn(alphas[std::size_t(k)], int(k), options);
    });
    std::vector<RainStroke> all;
    for (const auto& some : found) all.insert(all.end(), some.begin(), some.end());
    return all;
}

RainStatistics rainStatistics(std::span<const RainStroke> strokes, std::span<const ImageF> alphas)
{
    RainStatistics statistics;
    statistics.count = int(strokes.size());
    std::vector<double> weights, lengths;
    for (const RainStroke& stroke : strokes) {
        const double quality = stroke.isolation * stroke.straightness * stroke.plainness;
        weights.push_back(std::pow(stroke.length, 3) * (quality * quality + 1e-6));
        if (!stroke.inside) continue;
        lengths.push_back(stroke.length);
        statistics.meanLength += stroke.length, statistics.meanWidth += stroke.width;
    }
    // The mean of all, then three times again with a biweight about the last one, six median deviations wide.
    for (int round = 0; round < 4; ++round) {
        std::vector<double> off;
        for (const RainStroke& stroke : strokes)
            off.push_back(std::abs(std::remainder(stroke.slant - statistics.slant, std::numbers::pi)));
        std::vector<double> work = off;
        const double reach = round == 0 ? 0.0 : 6 * upperMedian(work);
        std::complex<double> sum = 0;
        double total = 0;
        for (std::size_t n = 0; n < strokes.size(); ++n) {
            const double t = reach > 0 ? std::min(off[n] / reach, 1.0) : 0.0;
            const double weight = weights[n] * (1 - t * t) * (1 - t * t);
            sum += std::polar(weight, 2 * strokes[n].slant), total += weight;
        }
        if (!(std::abs(sum) > 0)) break;
        statistics.slant = std::arg(sum) / 2;
        // The spread is that of all.
        if (round == 0)
            statistics.slantSpread = std::sqrt(std::max(0.0, -2 * std::log(std::min(1.0, std::abs(sum) / total)))) / 2;
    }
    if (!lengths.empty()) {
        statistics.meanLength /= double(lengths.size()), statistics.meanWidth /= double(lengths.size());
        statistics.medianLength = upperMedian(lengths);
    }
    double pixels = 0;
    for (const ImageF& alpha : alphas) pixels += double(alpha.width()) * alpha.height();
    if (pixels > 0) statistics.density = statistics.count / pixels * 1e6;
    return statistics;
}

}  // namespace virga::matte
