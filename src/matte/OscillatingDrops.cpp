#include "matte/OscillatingDrops.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/Error.h"
#include "core/Parallel.h"
#include "optics/DropOscillation.h"

namespace virga::matte {
namespace {

constexpr float kTurn = 2 * std::numbers::pi_v<float>;
constexpr int kColumnsPerTexel = 4;  // across, where the silhouette is sampled; along, intervals are integrated exactly
constexpr int kMomentsPerTexel = 4;  // moments of the exposure for one texel of path
constexpr int kAngles = 24;          // points of the outline from the pole to the equator

// Largest changes of shape, in mean radii. Their sum, with the mean oblateness of the largest drop that is used, stays
// inside a tile 1.25 diameters wide.
constexpr float kMaxAxisymmetric = 0.18f;  // a_2; the width changes by half of it
constexpr float kMaxTransverse = 0.05f;    // a_3; the sides move by 3/2 of it
constexpr float kMaxWeave = 0.04f;

// Hash of (seed, matte, question) to [0, 1). The mixer is Stafford's variant 13 of splitmix64.
class Dice {
public:
    Dice(std::uint32_t seed, int matte) : key_(std::uint64_t(seed) << 32 | std::uint32_t(matte)) {}

    float operator()()
    {
        std::uint64_t z = key_ + 0x9e3779b97f4a7c15u * ++question_;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        z ^= z >> 31;
        return float(z >> 40) * 0x1p-24f;
    }
    float between(float low, float high) { return low + (high - low) * (*this)(); }

private:
    std::uint64_t key_, question_ = 0;
};

float smoothstep(float from, float to, float x)
{
    const float t = std::clamp((x - from) / (to - from), 0.0f, 1.0f);
    return t * t * (3 - 2 * t);
}

// Terminal speed [m/s], Atlas, Srivastava & Sekhon 1973, from 0.5 mm; only sets the drop's path in diameters here.
float fallSpeed(float diameter_mm) { return 9.65f - 10.3f * std::exp(-0.6f * diameter_mm); }

struct Outline {
    std::array<float, kAngles + 1> sine, cosine, p2, p31;

    Outline()
    {
        for (int i = 0; i <= kAngles; ++i) {
            const float psi = kTurn / 4 * float(i) / kAngles;
            const float s = std::sin(psi), c = std::cos(psi);
            sine[i] = s, cosine[i] = c;
            p2[i] = 1.5f * c * c - 0.5f;
            p31[i] = 1.5f * (5 * c * c - 1) * s;
        }
    }
};

// One drop, its light, and its exposure from tau = 0 to 1.
struct Drop {
    float beadCycles, length;  // oscillations; path + 1, in diameters
    float rest;                // mean a_2
    float a2, phase2, a3, phase3;
    float weave, weaveCycles, weavePhase;

    float beads, beadSharpness, beadPhase;     // depth 0..1 of the dark between beads
    float speckle, specklePhase;               // the same at the transverse mode's frequency
    float drift;                               // brightness change from one end to the other
    float rim, coreWidth, coreSway, coreGrow;  // brightness at the rims over that at the core; core in radii
    float crescent;                            // depth of the dark crescents
    float sideLight;                           // brightness change from one side to the other
    float shutterRamp;                         // share of the exposure in which the shutter opens, or closes
};

Drop rollDrop(Dice& roll, float beadCycles, float strength, const OscillatingDropOptions& options)
{
    Drop d{};
    const float lively = options.liveliness;
    d.beadCycles = beadCycles * std::exp2(roll.between(-0.22f, 0.22f));  // fills the half octave between groups
    const float diameter_mm = 0.8f * std::pow(2.2f / 0.8f, roll());      // log-uniform over the drops that one sees
    const float path_m =
        fallSpeed(diameter_mm) * d.beadCycles / float(optics::oscillationFrequency(2, 1e-3 * diameter_mm));
    d.length = 1 + std::max(1.0f, 1e3f * path_m / diameter_mm);

    // Axis ratio (1 + a) / (1 - a / 2) of mode 2 alone, set to the mean ratio 1.03 - 0.062 D, D in mm.
    const float ratio = std::min(1.0f, 1.03f - 0.062f * diameter_mm);
    d.rest = lively * (ratio - 1) / (1 + ratio / 2);

    const float amount = lively * strength;
    // One matte leans to mode 2 (beads, bands), another to mode 3 (crescents left and right).
    const float transverse = roll();
    const float two = amount * (1 - 0.75f * smoothstep(0.55f, 1, transverse));
    const float three = amount * smoothstep(0.15f, 0.7f, transverse);
    d.a2 = kMaxAxisymmetric * two * roll.between(0.6f, 1), d.phase2 = kTurn * roll();
    d.a3 = kMaxTransverse * three * roll.between(0.6f, 1), d.phase3 = kTurn * roll();
    d.weave = kMaxWeave * amount * roll(), d.weavePhase = kTurn * roll();
    d.weaveCycles = std::min(d.beadCycles, 3.0f) * roll.between(0.3f, 0.7f);

    d.beads = std::min(0.6f, 0.75f * two * roll.between(0.3f, 1));
    d.beadSharpness = 3 * roll() * roll();
    d.beadPhase = kTurn * roll();
    d.speckle = 0.35f * three * roll();
    d.specklePhase = kTurn * roll();
    d.drift = lively * roll.between(-0.25f, 0.25f);

    const float kind = roll();
    const float rim = kind < 0.2f    ? roll.between(0.9f, 1)
                      : kind < 0.85f ? roll.between(0.4f, 0.85f)
                                     : roll.between(1.25f, 1.9f);
    d.rim = 1 + lively * (rim - 1);
    d.coreWidth = roll.between(0.4f, 0.75f);
    d.coreSway = three * roll.between(0.1f, 0.35f);
    d.coreGrow = two * roll.between(-0.4f, 0.4f);
    d.crescent = three * roll.between(0.2f, 0.7f);
    d.sideLight = lively * roll.between(-0.3f, 0.3f);
    d.shutterRamp = lively * 0.12f * roll() * roll();
    return d;
}

// Adds the time for which each point is covered. Between two edges of the silhouette a column is covered whole, so an
// interval [top, bottom] is two steps; a step at y inside a texel covers the rest of it. The steps are kept as
// differences along the column, and a running sum at the end makes them coverage: exact along, two adds an edge.
void expose(const Drop& drop, ImageView<float> tile, float acrossDiameters)
{
    static const Outline outline;
    const int W = tile.width(), L = tile.height(), columns = W * kColumnsPerTexel;
    // A path of a whole number of moments gives each texel in the middle the same number of them: no beats.
    const float wanted = float(L) * (1 - 1 / drop.length);
    const int moments = std::max(2, int(std::lround(wanted * kMomentsPerTexel)));
    const float path = float(moments) / kMomentsPerTexel;  // [texels]
    const float radius = (float(L) - path) / 2;            // along [texels]
    const float texelsPerRadius = float(columns) / (2 * acrossDiameters);

    const int stride = L + 2;
    std::vector<float> steps(std::size_t(columns) * stride, 0.0f), height(columns), half(columns);
    const float ratio32 = std::sqrt(30.0f / 8.0f);  // f_3 / f_2
    for (int k = 0; k < moments; ++k) {
        const float tau = (float(k) + 0.5f) / float(moments);
        const float theta = kTurn * drop.beadCycles * tau;
        const float s2 = std::sin(theta + drop.phase2), s3 = std::sin(ratio32 * theta + drop.phase3);
        const float a2 = drop.rest + drop.a2 * s2, a3 = drop.a3 * s3;
        const float centre = drop.weave * std::sin(kTurn * drop.weaveCycles * tau + drop.weavePhase);

        const float bead = std::exp(drop.beadSharpness * (std::sin(theta + drop.beadPhase) - 1));
        const float smoothBead = 0.5f + 0.5f * std::sin(theta + drop.beadPhase);
        const float sharp = std::min(1.0f, drop.beadSharpness);
        const float bright = drop.beads * (smoothBead + sharp * (bead - smoothBead));
        const float spot = 0.5f + 0.5f * std::sin(ratio32 * theta + drop.specklePhase);
        float light = (1 - drop.speckle + drop.speckle * spot) * (1 + drop.drift * (2 * tau - 1));
        if (drop.shutterRamp > 0)
            light *= smoothstep(0, drop.shutterRamp, tau) * smoothstep(0, drop.shutterRamp, 1 - tau);

        // Half the silhouette's height over each column; the largest counts where a deep mode folds the outline.
        std::fill(height.begin(), height.end(), 0.0f);
        for (const float side : {-1.0f, 1.0f}) {
            float x0 = 0, y0 = 0;
            for (int i = 0; i <= kAngles; ++i) {
                const float r = 1 + a2 * outline.p2[i] + side * a3 * outline.p31[i];
                const float x = (centre + side * r * outline.sine[i]) * texelsPerRadius + 0.5f * float(columns) - 0.5f;
                const float y = r * outline.cosine[i];
                if (i > 0 && x != x0) {
                    const float from = std::min(x0, x), to = std::max(x0, x);
                    const int first = std::max(0, int(std::ceil(from))),
                              last = std::min(columns - 1, int(std::floor(to)));
                    const float slope = (y - y0) / (x - x0);
                    for (int c = first; c <= last; ++c) height[c] = std::max(height[c], y0 + slope * (float(c) - x0));
                }
                x0 = x, y0 = y;
            }
        }

        const float y = radius + path * tau;
        const float core = drop.coreWidth * (1 + drop.coreGrow * s2);
        for (int c = 0; c < columns; ++c) {
            if (height[c] <= 0) continue;
            const float x = (float(c) + 0.5f - 0.5f * float(columns)) / texelsPerRadius - centre;
            const float away = (x - drop.coreSway * s3) / core;
            const float fall = 1 / (1 + away * away * away * away);
            float value = light * (drop.rim + (1 - drop.rim) * fall) * (1 + drop.sideLight * x);
            value *= 1 - drop.beads + bright * (0.4f + 0.6f * fall);  // a focus lights the core more than the rims
            const float lean = x > 0 ? s3 : -s3;
            if (lean > 0) value *= 1 - drop.crescent * smoothstep(0, 0.2f, std::abs(x) - (1 - 0.55f * lean));

            float* step = steps.data() + std::size_t(c) * stride;
            const float top = std::clamp(y - height[c] * radius, 0.0f, float(L));
            const float bottom = std::clamp(y + height[c] * radius, 0.0f, float(L));
            const int t = int(top), b = int(bottom);
            const float ft = top - float(t), fb = bottom - float(b);
            step[t] += value * (1 - ft), step[t + 1] += value * ft;
            step[b] -= value * (1 - fb), step[b + 1] -= value * fb;
        }
    }

    for (int y = 0; y < L; ++y) std::fill_n(tile.row(y), W, 0.0f);
    for (int c = 0; c < columns; ++c) {
        float running = 0;
        for (int y = 0; y < L; ++y) {
            running += steps[std::size_t(c) * stride + y];
            tile.at(c / kColumnsPerTexel, y) += std::max(running, 0.0f);
        }
    }
}

}  // namespace

StrokeAtlas makeOscillatingDropAtlas(std::uint32_t seed, const OscillatingDropOptions& options)
{
    const auto require = [](bool holds, const char* name, double value, const char* allowed) {
        if (!holds)
            throw Error(ErrorCode::InvalidArgument, "stroke atlas: {} = {} is out of range ({})", name, value, allowed);
    };
    require(options.width >= 4 && options.width <= 256, "width", options.width, "4..256");
    require(options.height >= 16 && options.height <= 1024, "height", options.height, "16..1024");
    require(options.groups >= 1 && options.groups <= 64, "groups", options.groups, "1..64");
    require(options.variants >= 2 && options.variants <= 64, "variants", options.variants, "2..64");
    require(options.firstBeadCycles > 0 && options.firstBeadCycles <= 100, "firstBeadCycles", options.firstBeadCycles,
            "above 0, up to 100");
    require(options.liveliness >= 0 && options.liveliness <= 1, "liveliness", options.liveliness, "0..1");

    StrokeAtlas atlas;
    atlas.width = options.width;
    atlas.height = options.height;
    atlas.groups = options.groups;
    atlas.variants = options.variants;
    atlas.firstBeadCycles = options.firstBeadCycles;
    const int count = atlas.groups * atlas.variants;
    atlas.layers = ImageF(atlas.width, atlas.height * count, 1);
    atlas.mattes.resize(count);
    parallelFor(0, count, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int n = int(first); n < int(last); ++n) {
            const int group = n / atlas.variants, variant = n % atlas.variants;
            const float beadCycles = atlas.firstBeadCycles * std::exp2(float(group) / atlas.groupsPerOctave);
            Dice roll(seed, n);
            const float strength = (float(variant) + roll.between(0.2f, 0.8f)) / float(atlas.variants);
            const Drop drop = rollDrop(roll, beadCycles, strength, options);
            expose(drop, atlas.layer(n), atlas.acrossDiameters);

            StrokeMatte& matte = atlas.mattes[n];
            matte.beadCycles = drop.beadCycles;
            matte.lengthDiameters = drop.length;
            // strokeLayer deals variant v to drops with 2 + s (variants - 2) > v; scan the sizes for where that holds.
            matte.minDiameter = matte.maxDiameter = 0;
            for (int i = 1; i <= 800; ++i) {
                const float diameter = 1e-5f * float(i);
                if (2 + oscillationStrength(diameter) * float(atlas.variants - 2) <= float(variant)) continue;
                if (matte.minDiameter == 0) matte.minDiameter = diameter;
                matte.maxDiameter = diameter;
            }
        }
    });
    finishAtlas(atlas);
    return atlas;
}

}  // namespace virga::matte
