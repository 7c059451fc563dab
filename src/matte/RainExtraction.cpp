#include "matte/RainExtraction.h"

#include <algorithm>
#include <cmath>

#include "core/Parallel.h"
#include "core/Simd.h"
#include "matte/Alternation.h"
#include "matte/DryScene.h"
#include "matte/ExposureGain.h"
#include "matte/PixelRows.h"
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
constexpr int firstSelections = 3;     // of pairs for C, before one is known
constexpr double surely = 1.0;         // standard error
constexpr double brightestReal = 1.5;  // of the range, for what a drop may return
constexpr double directionLimit = 2.0, wetLimit = 4.0;  // [sigma] above the scene
constexpr std::size_t risesStride = 3;
constexpr double leastSure = 0.3;     // of |C - S|: the largest error of a C that is used
constexpr double brightestColor = 8;  // of the range, for light that was added
constexpr int stepsBelow = 2;
constexpr double toleranceBelow = 1e-4;
constexpr float opaque = 0.99f;          // what is behind more than this is not there to be seen
constexpr double leastStep = 0.5 / 255;  // of the range: rises that are less say nothing of C
constexpr int stepsARound = 2;
constexpr double nearby = 0.3;          // sigma, on average: a scene that its first step moves less needs one a round
constexpr double roundingShare = 1e-6;  // of F: what rounding may add in a step

VIRGA_SIMD void keepAbove(float* __restrict rises, const float* __restrict trusted, float limit, int count)
{
    for (int i = 0; i < count; ++i) {
        const float rise = rises[i] - limit;
        rises[i] = rise > 0.0f ? rise * trusted[i] : 0.0f;
    }
}

/// How far the frames rise above the scene, the mean of the channels, beyond `limit`.
std::vector<ImageF> risesAbove(std::span<const ImageF> frames, std::span<const ImageF> trust, const ImageF& scene,
                               double limit)
{
    const int width = scene.width();
    const std::vector<float> ones(std::size_t(width), 1.0f);
    std::vector<ImageF> rises(frames.size());
    parallelFor(0, std::ptrdiff_t(frames.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (auto k = std::size_t(first); k < std::size_t(last); ++k) {
            rises[k] = ImageF(width, scene.height(), 1);
            for (int y = 0; y < scene.height(); ++y) {
                float* row = rises[k].row(y);
                meanDifference(frames[k].row(y), scene.row(y), scene.channels(), std::size_t(width), row);
                keepAbove(row, trust.empty() ? ones.data() : trust[k].row(y), float(limit), width);
            }
        }
    });
    return rises;
}

/// The 95th percentile of the scene's brightness where `rises` are beyond `limit`.
double brightestUnder(std::span<const ImageF> rises, double limit, const ImageF& scene)
{
    const auto channels = std::size_t(scene.channels());
    std::vector<float> under;
    for (const ImageF& rise : rises)
        for (std::size_t i = 0; i < rise.size(); i += risesStride) {
            if (!(rise.data()[i] > float(limit))) continue;
            float sum = 0.0f;
            for (std::size_t j = 0; j < channels; ++j) sum += scene.data()[i * channels + j];
            under.push_back(sum / float(channels));
        }
    if (under.empty()) return 0.0;
    const auto at = under.begin() + std::ptrdiff_t((under.size() - 1) * 95 / 100);
    std::nth_element(under.begin(), at, under.end());
    return *at;
}

template <int channels>
VIRGA_INLINE void contrastAny(const float* __restrict scene, const float* __restrict color, std::size_t count,
                              float* __restrict to)
{
    for (std::size_t i = 0; i < count; ++i) {
        float square = 0.0f;
        for (std::size_t j = 0; j < channels; ++j) {
            const float gap = color[j] - scene[i * channels + j];
            square += gap * gap;
        }
        to[i] = std::sqrt(square);
    }
}
VIRGA_SIMD void contrastRow(const float* scene, const float* color, int channels, std::size_t count, float* to)
{
    if (channels == 3)
        contrastAny<3>(scene, color, count, to);
    else
        contrastAny<1>(scene, color, count, to);
}

/// |C - S|, what an alpha of 1 would change.
ImageF contrastOf(const ImageF& scene, const std::array<float, 3>& color)
{
    ImageF contrast(scene.width(), scene.height(), 1);
    contrastRow(scene.data(), color.data(), scene.channels(), contrast.size(), contrast.data());
    return contrast;
}

VIRGA_SIMD void addRow(const float* __restrict row, int count, float* __restrict to)
{
    for (int i = 0; i < count; ++i) to[i] += row[i];
}

/// From the sum of the alphas along the rain in `cost`.
VIRGA_SIMD void costRow(const float* __restrict sigma, const float* __restrict contrast, int count,
                        float* __restrict cost)
{
    for (int i = 0; i < count; ++i) {
        const float mean = cost[i] / float(2 * alongReach + 1);
        cost[i] = float(costOfNothing) * sigma[i] * contrast[i] * float(1.0 + costOfSpecks) /
                  (1.0f + float(costOfSpecks) * mean * contrast[i] / sigma[i]);
    }
}

/// Eta of each alpha. For a change of alpha by one the data move by |C - S|, so eta = t sigma |C - S| holds back what
/// is below t sigma. t falls with the mean of the 2 alongReach + 1 alphas along the rain.
void setCosts(const std::vector<ImageF>& alphas, const ImageF& contrast, const NoiseMap& noise, double slant,
              std::vector<ImageF>& costs)
{
    const int width = contrast.width(), height = contrast.height();
    costs.resize(alphas.size());
    const double s = std::sin(slant), c = std::cos(slant), steepest = std::max(std::abs(s), std::abs(c));
    parallelFor(0, std::ptrdiff_t(alphas.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        std::vector<float> sigma(static_cast<std::size_t>(width));
        for (auto k = std::size_t(first); k < std::size_t(last); ++k) {
            if (costs[k].empty()) costs[k] = ImageF(width, height, 1);
            for (int y = 0; y < height; ++y) {
                float* cost = costs[k].row(y);
                std::fill_n(cost, width, 0.0f);
                for (int t = -alongReach; t <= alongReach; ++t) {
                    const int dx = int(std::lround(t * s / steepest)), dy = int(std::lround(t * c / steepest));
                    const int left = std::max(0, -dx), right = std::min(width, width - dx);
                    if (y + dy < 0 || y + dy >= height || left >= right) continue;
                    addRow(alphas[k].row(y + dy) + left + dx, right - left, cost + left);
                }
                if (y == 0 || y % NoiseMap::block == 0)
                    for (int x = 0; x < width; ++x) sigma[std::size_t(x)] = noise.at(x, y);
                costRow(sigma.data(), contrast.row(y), width, cost);
            }
        }
    });
}

/// Of every third of the values, of which there is one at least.
double medianOf(std::span<const float> values)
{
    std::vector<float> some;
    for (std::size_t i = 0; i < values.size(); i += 3) some.push_back(values[i]);
    const auto middle = some.begin() + std::ptrdiff_t(some.size() / 2);
    std::nth_element(some.begin(), middle, some.end());
    return *middle;
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
    const double gap = std::abs(color - medianOf(scene.values()));
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

double meanDistance(const ImageF& one, const ImageF& other)
{
    double sum = 0.0;
    for (int y = 0; y < one.height(); ++y) {
        const float *a = one.row(y), *b = other.row(y);
        float row = 0.0f;
        for (int i = 0; i < one.width() * one.channels(); ++i) row += std::abs(a[i] - b[i]);
        sum += double(row);
    }
    return sum / double(one.size());
}

/// F falls in each step, of alphas and then of the scene, or the loop ends. (That either half lets it fall is what
/// tests/matte/alternation_test.cpp asks.)
class Descent {
public:
    Descent(const Footage& footage, Extraction& extraction) : footage_(footage), to_(extraction) {}

    void begin() { before_ = objective().total(); }
    bool step(double tolerance)
    {
        solveAlpha(footage_, to_.scene, to_.terms, to_.alphas, tolerance);
        if (!falls(objective())) return false;
        solveScene(footage_, to_.alphas, to_.terms, to_.scene, tolerance);
        to_.history.push_back(objective());
        return falls(to_.history.back());
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
    paper.terms.color = options.color.value_or(options.fallbackColor.value_or(std::array{1.0f, 1.0f, 1.0f}));
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
    {
        const double sigma = dry.noise.typical;
        const std::vector<ImageF> rises = risesAbove(frames, dry.trust, result.scene, directionLimit * sigma);
        result.direction = rainDirection(rises);
        result.brightestWet = brightestUnder(rises, (wetLimit - directionLimit) * sigma, result.scene);
    }
    result.range = dry.range;
    const float white = dry.range > 1.0 ? float(brightestReal * dry.range) : 1.0f;
    const std::array<float, 3> fallback = options.fallbackColor.value_or(std::array{white, white, white});
    if (options.slant) result.direction.slant = *options.slant;

    RainTerms& terms = result.terms;
    const auto setTerms = [&] {
        const double sigma = dry.noise.typical;
        const ImageF contrast = contrastOf(result.scene, terms.color);
        const double gap = medianOf(contrast.values());  // a lamp is brighter than everything else together
        terms.mu = options.mu.value_or(std::pow(sigma * gap / (slopeOfRain * dry.range), 2));
        terms.lambda = options.lambda.value_or(std::min(std::pow(sigma / (slopeOfScene * dry.range), 2), mostLambda));
    };
    terms.color = options.color.value_or(fallback);
    terms.eta = 1.0;  // costs are whole etas
    terms.slant = result.direction.slant;
    result.alphas.assign(frames.size(), ImageF(result.scene.width(), result.scene.height(), 1));
    std::vector<ImageF> costs;
    double guess = dry.range;  // of C's channels' mean
    int selections = firstSelections;
    const auto chooseColor = [&] {
        if (options.color) return;
        const RainColor found = rainColor({frames, dry.trust}, result.scene, terms.slant,
                                          std::max(dry.noise.typical, leastStep * dry.range), guess, selections);
        guess = found.found ? meanOf(std::span(found.color).first(channels)) : dry.range;
        selections = found.found ? 1 : firstSelections;
        result.colorSource = sourceOf(found, result.scene, dry.range);
        const bool isFound = result.colorSource != ColorSource::Fallback;
        terms.color = isFound ? capped(found.color, brightestColor * dry.range) : fallback;
        result.colorError = found.error;
    };
    int steps = stepsARound;
    for (int round = 0; round < options.rounds && !result.rose; ++round) {
        setTerms();
        setCosts(result.alphas, contrastOf(result.scene, terms.color), dry.noise, terms.slant, costs);
        const Footage footage{frames, dry.trust, costs};
        Descent descent(footage, result);
        descent.begin();
        ImageF before = round == 0 ? result.scene : ImageF();
        for (int step = 0; step < steps && descent.step(options.tolerance); ++step) {
            // Few frames and dense rain begin far from their scene and come to it slowly. Elsewhere the next round's
            // costs and colour change more than a second step does.
            if (!before.empty() && meanDistance(before, result.scene) < nearby * dry.noise.typical) steps = 1;
            before = ImageF();
        }
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
