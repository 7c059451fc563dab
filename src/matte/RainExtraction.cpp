#include "matte/RainExtraction.h"

#include <algorithm>
#include <cmath>

#include "core/Parallel.h"
#include "matte/Alternation.h"
#include "matte/DryScene.h"
#include "matte/ExposureGain.h"
#include "matte/RainColor.h"

namespace virga::matte {
namespace {

// Rms, of the footage's range [1/px]. Halves and doubles change alpha's error by less than 5 % on the reference cases.
constexpr double slopeOfRain = 0.06;  // of alpha |C - S| along a stroke, its ends counted
constexpr double slopeOfScene = 0.1;
constexpr double mostLambda = 0.2;
constexpr double costOfNothing = 0.3;  // of alpha in a stroke, as a threshold [sigma]
constexpr double costOfSpecks = 4.0;   // so many times more where nothing along the rain speaks for a stroke
constexpr int alongReach = 4;          // [px], to each side: what speaks for a stroke
constexpr double surely = 1.0;         // standard error
constexpr double brightestReal = 1.5;  // of the range, for what a drop may return
constexpr std::size_t risesStride = 3;
constexpr double leastSure = 0.3;     // of |C - S|: the largest error of a C that is used
constexpr double brightestColor = 8;  // of the range, for light that was added
constexpr int stepsBelow = 2;
constexpr double toleranceBelow = 1e-4;
constexpr float opaque = 0.99f;          // what is behind more than this is not there to be seen
constexpr double leastStep = 0.5 / 255;  // of the range: rises that are less say nothing of C
constexpr int stepsARound = 2;
constexpr double roundingShare = 1e-6;  // of F: what rounding may add in a half step

/// How far the frames rise above the scene, the mean of the channels, beyond `limit` times the noise.
std::vector<ImageF> risesAbove(std::span<const ImageF> frames, std::span<const ImageF> trust, const ImageF& scene,
                               double limit)
{
    const int channels = scene.channels();
    std::vector<ImageF> rises(frames.size());
    parallelFor(0, std::ptrdiff_t(frames.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (auto k = std::size_t(first); k < std::size_t(last); ++k) {
            rises[k] = ImageF(scene.width(), scene.height(), 1);
            for (std::size_t i = 0; i < rises[k].size(); ++i) {
                float sum = 0.0f;
                for (int j = 0; j < channels; ++j)
                    sum += frames[k].data()[i * std::size_t(channels) + std::size_t(j)] -
                           scene.data()[i * std::size_t(channels) + std::size_t(j)];
                const float rise = std::max(sum / float(channels) - float(limit), 0.0f);
                rises[k].data()[i] = trust.empty() ? rise : rise * trust[k].data()[i];
            }
        }
    });
    return rises;
}

/// The 95th percentile of the scene's brightness where `rises` are.
double brightestUnder(std::span<const ImageF> rises, const ImageF& scene)
{
    const auto channels = std::size_t(scene.channels());
    std::vector<float> under;
    for (const ImageF& rise : rises)
        for (std::size_t i = 0; i < rise.size(); i += risesStride) {
            if (!(rise.data()[i] > 0.0f)) continue;
            float sum = 0.0f;
            for (std::size_t j = 0; j < channels; ++j) sum += scene.data()[i * channels + j];
            under.push_back(sum / float(channels));
        }
    if (under.empty()) return 0.0;
    const auto at = under.begin() + std::ptrdiff_t((under.size() - 1) * 95 / 100);
    std::nth_element(under.begin(), at, under.end());
    return *at;
}

/// |C - S|, what an alpha of 1 would change.
ImageF contrastOf(const ImageF& scene, const std::array<float, 3>& color)
{
    ImageF contrast(scene.width(), scene.height(), 1);
    const auto channels = std::size_t(scene.channels());
    for (std::size_t i = 0; i < contrast.size(); ++i) {
        float square = 0.0f;
        for (std::size_t j = 0; j < channels; ++j) {
            const float gap = color[j] - scene.data()[i * channels + j];
            square += gap * gap;
        }
        contrast.data()[i] = std::sqrt(square);
    }
    return contrast;
}

/// Means of 2 alongReach + 1 alphas along the rain.
ImageF meanAlong(const ImageF& alpha, double slant)
{
    const int width = alpha.width(), height = alpha.height();
    ImageF mean(width, height, 1);
    const double s = std::sin(slant), c = std::cos(slant);
    const double steepest = std::max(std::abs(s), std::abs(c));
    for (int t = -alongReach; t <= alongReach; ++t) {
        const int dx = int(std::lround(t * s / steepest)), dy = int(std::lround(t * c / steepest));
        for (int y = std::max(0, -dy); y < std::min(height, height - dy); ++y) {
            const float* from = alpha.row(y + dy);
            float* to = mean.row(y);
            for (int x = std::max(0, -dx); x < std::min(width, width - dx); ++x) to[x] += from[x + dx];
        }
    }
    for (float& value : mean.values()) value /= float(2 * alongReach + 1);
    return mean;
}

/// Eta of each alpha. For a change of alpha by one the data move by |C - S|, so eta = t sigma |C - S| holds back what
/// is below t sigma. t falls with the mean of what was found along the rain.
void setCosts(const std::vector<ImageF>& alphas, const ImageF& contrast, const NoiseMap& noise, double slant,
              std::vector<ImageF>& costs)
{
    costs.resize(alphas.size());
    parallelFor(0, std::ptrdiff_t(alphas.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (auto k = std::size_t(first); k < std::size_t(last); ++k) {
            costs[k] = meanAlong(alphas[k], slant);
            for (int y = 0; y < contrast.height(); ++y)
                for (int x = 0; x < contrast.width(); ++x) {
                    const float sigma = noise.at(x, y), gap = contrast.at(x, y);
                    float& cost = costs[k].at(x, y);
                    cost = float(costOfNothing) * sigma * gap * float(1.0 + costOfSpecks) /
                           (1.0f + float(costOfSpecks) * cost * gap / sigma);
                }
        }
    });
}

double meanOf(std::span<const float> values)
{
    double sum = 0.0;
    for (const float value : values) sum += value;
    return sum / double(values.size());
}

/// Whether what the strokes say of C is good enough.
ColorSource sourceOf(const RainColor& found, const ImageF& scene, double range)
{
    if (!found.found) return ColorSource::Fallback;
    const double color = meanOf(std::span(found.color).first(std::size_t(scene.channels())));
    const double gap = std::abs(color - meanOf(scene.values()));
    if (found.error <= leastSure * gap && color > 0.0) return ColorSource::Strokes;
    return color - surely * found.error > brightestReal * range ? ColorSource::Added : ColorSource::Fallback;
}

std::array<float, 3> capped(std::array<float, 3> color, double most)
{
    const double brightest = *std::max_element(color.begin(), color.end());
    if (brightest > most)
        for (float& value : color) value *= float(most / brightest);
    return color;
}

/// F falls in each half step, or the loop ends.
class Descent {
public:
    Descent(const Footage& footage, Extraction& extraction) : footage_(footage), to_(extraction) {}

    void begin() { before_ = objective().total(); }
    bool alphaStep(double tolerance)
    {
        solveAlpha(footage_, to_.scene, to_.terms, to_.alphas, tolerance);
        return falls(objective());
    }
    bool sceneStep(double tolerance)
    {
        solveScene(footage_, to_.alphas, to_.terms, to_.scene, tolerance);
        const RainObjective now = objective();
        to_.history.push_back(now);
        return falls(now);
    }

private:
    RainObjective objective() const { return rainObjective(footage_, to_.scene, to_.alphas, to_.terms); }
    bool falls(const RainObjective& now)
    {
        to_.rose |= now.total() > before_ * (1.0 + roundingShare);
        before_ = now.total();
        return !to_.rose;
    }

    const Footage& footage_;
    Extraction& to_;
    double before_ = 0;
};

Extraction paperExtraction(std::vector<ImageF>& frames, const ExtractionOptions& options)
{
    AlternationOptions paper;
    paper.terms.color = options.color.value_or(options.fallbackColor);
    paper.terms.lambda = options.lambda.value_or(1.0 / 20);
    paper.terms.mu = options.mu.value_or(1.0 / 4);
    paper.terms.bounded = false;
    paper.terms.slant = options.slant.value_or(0.0);
    paper.findSlant = !options.slant;
    paper.iterations = options.rounds;
    paper.stepTolerance = std::min(options.tolerance, 1e-7);
    Alternation found = alternate({frames}, paper);
    Extraction result;
    result.scene = std::move(found.scene);
    result.alphas = std::move(found.alphas);
    result.gains.assign(frames.size() * std::size_t(result.scene.channels()), 1.0);
    result.color = paper.terms.color;
    result.colorSource = options.color ? ColorSource::Given : ColorSource::Fallback;
    result.direction = rainDirection(result.alphas);
    if (options.slant) result.direction.slant = *options.slant;
    result.terms = paper.terms;
    result.terms.slant = found.slant;
    result.noise = noiseMap(frames, {}, result.scene, 1e-6, 0.0);
    result.history = std::move(found.history);
    result.rose = found.rose;
    return result;
}

}  // namespace

Extraction extractRain(std::vector<ImageF>& frames, const ExtractionOptions& options, const ImageF& scene,
                       std::span<const ImageF> covered)
{
    if (options.paper) return paperExtraction(frames, options);
    checkFootage({frames});
    Extraction result;
    const auto channels = std::size_t(frames[0].channels());
    result.gains = exposureGains(frames);
    parallelFor(0, std::ptrdiff_t(frames.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (auto k = std::size_t(first); k < std::size_t(last); ++k)
            removeGain(frames[k], std::span(result.gains).subspan(k * channels, channels));
    });

    DryScene dry = dryScene(frames, options.movers, scene, covered);
    result.scene = std::move(dry.scene);
    result.direction = rainDirection(risesAbove(frames, dry.trust, result.scene, 2.0 * dry.noise.typical));
    result.brightestWet =
        brightestUnder(risesAbove(frames, dry.trust, result.scene, 4.0 * dry.noise.typical), result.scene);
    result.range = dry.range;
    if (options.slant) result.direction.slant = *options.slant;

    RainTerms& terms = result.terms;
    const auto setTerms = [&] {
        const double sigma = dry.noise.typical;
        const ImageF contrast = contrastOf(result.scene, terms.color);
        double square = 0.0;
        for (const float gap : contrast.values()) square += double(gap) * gap / double(contrast.size());
        terms.mu = options.mu.value_or(std::pow(sigma / (slopeOfRain * dry.range), 2) * square);
        terms.lambda = options.lambda.value_or(std::min(std::pow(sigma / (slopeOfScene * dry.range), 2), mostLambda));
    };
    terms.color = options.color.value_or(options.fallbackColor);
    terms.eta = 1.0;  // costs are whole etas
    terms.slant = result.direction.slant;
    result.alphas.assign(frames.size(), ImageF(result.scene.width(), result.scene.height(), 1));
    std::vector<ImageF> costs;
    const auto chooseColor = [&] {
        if (options.color) return;
        const RainColor found = rainColor({frames, dry.trust}, result.scene, terms.slant,
                                          std::max(dry.noise.typical, leastStep * dry.range), dry.range);
        result.colorSource = sourceOf(found, result.scene, dry.range);
        const bool isFound = result.colorSource != ColorSource::Fallback;
        terms.color = isFound ? capped(found.color, brightestColor * dry.range) : options.fallbackColor;
        result.colorError = found.error;
    };
    for (int round = 0; round < options.rounds && !result.rose; ++round) {
        setTerms();
        setCosts(result.alphas, contrastOf(result.scene, terms.color), dry.noise, terms.slant, costs);
        const Footage footage{frames, dry.trust, costs};
        Descent descent(footage, result);
        descent.begin();
        for (int step = 0; step < stepsARound; ++step)
            if (!descent.alphaStep(options.tolerance) || !descent.sceneStep(options.tolerance)) break;
        if (round == 0) renewTrust(frames, result.scene, covered, dry);
        if (!options.slant) {
            result.direction = rainDirection(result.alphas);
            terms.slant = result.direction.slant;
        }
        chooseColor();
    }
    // The last alphas belong to the scene and the colour that are handed out.
    setCosts(result.alphas, contrastOf(result.scene, terms.color), dry.noise, terms.slant, costs);
    solveAlpha({frames, dry.trust, costs}, result.scene, terms, result.alphas, options.tolerance);
    result.color = terms.color;
    result.trust = std::move(dry.trust);
    result.noise = std::move(dry.noise);
    if (options.slant) result.direction = {*options.slant, rainDirection(result.alphas).coherence};
    return result;
}

std::vector<ImageF> alphasBelow(std::span<const ImageF> frames, std::span<const std::size_t> which,
                                const Extraction& extraction)
{
    std::vector<ImageF> mirrored, trust;
    for (const std::size_t k : which) {
        ImageF& mirror = mirrored.emplace_back(frames[k]);
        for (std::size_t i = 0; i < mirror.size(); ++i)
            mirror.data()[i] = 2.0f * extraction.scene.data()[i] - mirror.data()[i];
        if (!extraction.trust.empty()) trust.push_back(extraction.trust[k]);
    }
    std::vector<ImageF> alphas(which.size(), ImageF(extraction.scene.width(), extraction.scene.height(), 1)), costs;
    const ImageF contrast = contrastOf(extraction.scene, extraction.color);
    for (int step = 0; step < stepsBelow; ++step) {
        setCosts(alphas, contrast, extraction.noise, extraction.terms.slant, costs);
        solveAlpha({mirrored, trust, costs}, extraction.scene, extraction.terms, alphas, toleranceBelow);
    }
    return alphas;
}

void removeRain(ImageF& frame, const ImageF& alpha, const ImageF& scene, const ImageF* trust,
                const std::array<float, 3>& color)
{
    const auto channels = std::size_t(frame.channels());
    for (std::size_t i = 0; i < alpha.size(); ++i) {
        const float a = alpha.data()[i];
        if (a == 0.0f) continue;
        const bool isScene = trust == nullptr || trust->data()[i] > 0.5f;
        for (std::size_t j = 0; j < channels; ++j) {
            float& value = frame.data()[i * channels + j];
            if (isScene)
                value -= a * (color[j] - scene.data()[i * channels + j]);
            else
                value = a < opaque ? (value - a * color[j]) / (1.0f - a) : scene.data()[i * channels + j];
        }
    }
}

ImageF alphaConfidence(const Extraction& extraction, const ImageF* trust)
{
    ImageF confidence = contrastOf(extraction.scene, extraction.color);
    for (std::size_t i = 0; i < confidence.size(); ++i) {
        const double gap = confidence.data()[i], weight = trust != nullptr ? double(trust->data()[i]) : 1.0;
        const double seen = weight * gap * gap, held = 2.0 * extraction.terms.mu;
        confidence.data()[i] = seen + held > 0.0 ? float(seen / (seen + held)) : 0.0f;
    }
    return confidence;
}

}  // namespace virga::matte
