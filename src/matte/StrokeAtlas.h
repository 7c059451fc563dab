// The mattes that strokes are drawn with: what a falling drop leaves on the film while the shutter is open, as a
// fraction of its own brightest point. After Wang et al. 2006, section 3 (a random stroke matte for each particle,
// stretched to the length of its path); theirs are cut from footage, ours come from OscillatingDrops.h or AtlasSheet.h.
//
// A tile, in texture coordinates u across and v along, both 0..1, texel centres at (i + 1/2) / size:
//   v = 0 (top row)   where the drop was when the shutter opened, v = 1 where it was when the shutter closed, so that a
//                     tile drawn upright shows a drop falling down the picture. The tile's length stands for
//                     (path + one diameter): the round ends of the path are inside the tile.
//   u                 from one side to the other, the path in the middle. The tile's width stands for
//                     `acrossDiameters` drop diameters; mirroring u gives an equally good matte.
// Values are 0..1 with a peak of exactly 1 in each tile. Opacity of a stroke = value x physical peak, where the
// physical peak of a drop of diameter D on a path s > D is D / s (the share of the exposure during which it covers a
// point). Divided by the matte's mass, that peak gives each matte the light of a plain drop.
#pragma once

#include <vector>

#include "core/Image.h"

namespace virga::matte {

/// What is known about one matte.
struct StrokeMatte {
    float beadCycles = -1;       // oscillations (mode 2) during the exposure that it was made for; < 0 unknown
    float lengthDiameters = -1;  // tile length / drop diameter that it was made for; < 0 unknown
    float minDiameter = 0;       // drops that may wear it, equivalent diameter [m], ends included
    float maxDiameter = 1;       // [m]
    float mass = 1;              // mean over the tile / mean of a plain round drop's tile of the same length
    float lengthPixels = 0;      // of the stroke in the footage that it was cut from; 0 unknown or not from footage
    float widthPixels = 0;       // the same, across
    float exposure = 0;          // of that footage [s]; 0 unknown
};

/// N mattes of one size, and the integrals that make any box filter over them exact. Fill `layers` and `mattes`, then
/// call finishAtlas.
struct StrokeAtlas {
    int width = 0;                 // W, texels across
    int height = 0;                // L, texels along
    float acrossDiameters = 1.25;  // tile width / drop diameter; > 1 leaves room for a drop that wobbles

    // Layers are ordered by group, then by how strongly the drop oscillates. Group g was made for
    // firstBeadCycles * 2^(g / groupsPerOctave) oscillations; an atlas that knows nothing about them has one group.
    int groups = 1;
    int variants = 0;  // mattes a group; groups * variants = N
    float firstBeadCycles = 1;
    float groupsPerOctave = 2;

    ImageF layers;                    // W x (N * L) x 1: tile after tile, the memory order of a 2-D array texture
    std::vector<StrokeMatte> mattes;  // N

    // Derived by finishAtlas.
    std::vector<float> alongProfile;  // N x L: integral of the row over the tile's width, in drop diameters. The middle
                                      // of a plain round drop's stroke has pi/4 (the mean of sqrt(1 - x^2))
    std::vector<float> alongPrefix;   // N x (L + 1): integral of alongProfile from v = 0 to k / L. Interpolated
                                      // linearly, (P(v1) - P(v0)) / (v1 - v0) is the exact mean over [v0, v1]
    std::vector<float> summedArea;    // N x (L + 1) x (W + 1): sum of the texels above row r and left of column c,
                                      // row-major. Interpolated bilinearly, the usual four corners / (texels in the
                                      // box) is the exact mean over the box, to 1e-4 for boxes of a texel and more

    int count() const { return int(mattes.size()); }
    ConstImageViewF layer(int n) const { return {layers.row(n * height), width, height, 1}; }
    ImageView<float> layer(int n) { return {layers.row(n * height), width, height, 1}; }
};

/// Scales every tile to a peak of 1 and fills mass and all that is derived. Mass is measured against a plain drop of
/// the matte's lengthDiameters, or, where that is unknown, of 20.
/// Throws Error(Internal) if sizes disagree, Error(Input) if a tile is empty (no value > 0) or not finite.
void finishAtlas(StrokeAtlas& atlas);

/// How strongly a drop of this equivalent diameter [m] oscillates as it falls, 0..1. Drops under about 1 mm shed no
/// eddies and are quiet; eddy shedding meets mode 2 at 1.4-1.6 mm, where amplitudes are largest (Beard, Ochs & Kubesh
/// 1991); larger drops keep about half of that from collisions and turbulence. The smooth curve between is ours.
float oscillationStrength(float diameter) noexcept;

/// Which layer a drop wears. The group is the nearest to beadCycles (on a log scale, ends included); within it a drop
/// of oscillationStrength s draws one of the first 2 + s (variants - 2) mattes, uniformly by `random` in [0, 1).
/// beadCycles <= 0 or NaN falls in the first group. Does not throw; the atlas must not be empty.
int strokeLayer(const StrokeAtlas& atlas, float beadCycles, float strength, float random) noexcept;

/// Mean of layer n over the box [u0, u1] x [v0, v1], outside the tile counted as 0; from summedArea, exact as said
/// there. The reference for the GPU's stroke sampling. Needs u1 > u0, v1 > v0.
double boxMean(const StrokeAtlas& atlas, int n, double u0, double u1, double v0, double v1);

/// Mean of alongProfile of layer n over [v0, v1], outside the tile counted as 0. Needs v1 > v0.
double alongMean(const StrokeAtlas& atlas, int n, double v0, double v1);

/// What a plain round drop leaves: the mean over the tile of an unperturbed sphere's matte, peak 1. The time that it
/// spends over all points is the area of its disc, so (pi/4 / acrossDiameters) max(1, n - 1) / n with
/// n = lengthDiameters > 1.
double plainMean(double lengthDiameters, double acrossDiameters) noexcept;

}  // namespace virga::matte
