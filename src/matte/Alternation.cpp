#include "matte/Alternation.h"

#include <cmath>

#include "core/Error.h"
#include "matte/RainDirection.h"
#include "matte/TemporalMedian.h"

namespace virga::matte {
namespace {

/// Of F: what rounding to float may add in a half step.
constexpr double roundingShare = 1e-6;

/// One map a frame, each of the frames' size; or none at all.
void checkMaps(std::span<const ImageF> maps, const char* name, std::span<const ImageF> frames)
{
    const ImageF& first = frames[0];
    if (!maps.empty() && maps.size() != frames.size())
        throw Error(ErrorCode::InvalidArgument, "extraction needs a {} for each of {} frames or none; got {}", name,
                    frames.size(), maps.size());
    for (const ImageF& map : maps)
        if (map.width() != first.width() || map.height() != first.height() || map.channels() != 1)
            throw Error(ErrorCode::InvalidArgument, "{} needs the frames' size, {} x {} x 1, and has {} x {} x {}",
                        name, first.width(), first.height(), map.width(), map.height(), map.channels());
}

void checkOptions(const AlternationOptions& options)
{
    const RainTerms& terms = options.terms;
    const auto isCost = [](double value) { return value >= 0.0 && std::isfinite(value); };
    if (!isCost(terms.lambda) || !isCost(terms.mu) || !isCost(terms.eta))
        throw Error(ErrorCode::InvalidArgument, "lambda, mu and eta are finite and not negative; got {}, {} and {}",
                    terms.lambda, terms.mu, terms.eta);
    if (options.iterations < 1)
        throw Error(ErrorCode::InvalidArgument, "extraction needs at least one iteration; got {}", options.iterations);
}

}  // namespace

void checkFootage(const Footage& footage)
{
    const std::span<const ImageF> frames = footage.frames;
    if (frames.empty()) throw Error(ErrorCode::InvalidArgument, "extraction needs at least one frame and got none");
    const ImageF& first = frames[0];
    if (first.empty() || (first.channels() != 1 && first.channels() != 3))
        throw Error(ErrorCode::InvalidArgument, "extraction needs pictures of 1 or 3 channels and got {} x {} x {}",
                    first.width(), first.height(), first.channels());
    for (std::size_t k = 0; k < frames.size(); ++k) {
        const ImageF& frame = frames[k];
        if (frame.width() != first.width() || frame.height() != first.height() || frame.channels() != first.channels())
            throw Error(ErrorCode::InvalidArgument,
                        "extraction needs frames of one size; the first has {} x {} x {}, number {} has {} x {} x {}",
                        first.width(), first.height(), first.channels(), k + 1, frame.width(), frame.height(),
                        frame.channels());
        for (float value : frame.values())
            if (!std::isfinite(value))
                throw Error(ErrorCode::InvalidArgument, "extraction needs finite pixels; frame number {} holds {}",
                            k + 1, value);
    }
    checkMaps(footage.trust, "trust", frames);
    checkMaps(footage.cost, "cost", frames);
    for (const ImageF& cost : footage.cost)
        for (const float value : cost.values())
            if (!(value >= 0.0f) || !std::isfinite(value))
                throw Error(ErrorCode::InvalidArgument, "cost is finite and not negative; it holds {}", value);
}

Alternation alternate(const Footage& footage, const AlternationOptions& options)
{
    checkFootage(footage);
    checkOptions(options);
    const std::span<const ImageF> frames = footage.frames;
    RainTerms terms = options.terms;
    Alternation result;
    result.scene = temporalMedian(frames);
    result.alphas.assign(frames.size(), ImageF(result.scene.width(), result.scene.height(), 1));

    double before = rainObjective(footage, result.scene, result.alphas, terms).total();
    const auto falls = [&](double now) { return now <= before * (1.0 + roundingShare); };
    for (int iteration = 0; iteration < options.iterations && !result.rose; ++iteration) {
        const double atStart = before;
        solveAlpha(footage, result.scene, terms, result.alphas, options.stepTolerance);
        result.slant = terms.slant;
        before = rainObjective(footage, result.scene, result.alphas, terms).total();
        result.rose |= before > atStart * (1.0 + roundingShare);

        solveScene(footage, result.alphas, terms, result.scene, options.stepTolerance);
        const RainObjective now = rainObjective(footage, result.scene, result.alphas, terms);
        result.rose |= !falls(now.total());
        before = now.total();
        result.history.push_back(now);

        const bool settled = atStart - before <= options.tolerance * before;
        if (options.findSlant) {
            const double slant = rainDirection(result.alphas).slant;
            const bool turned = std::abs(slant - terms.slant) > 1e-4;
            terms.slant = slant;
            // Another direction is another F.
            if (turned) {
                before = rainObjective(footage, result.scene, result.alphas, terms).total();
                continue;
            }
        }
        if (options.tolerance > 0.0 && settled) break;
    }
    return result;
}

}  // namespace virga::matte
