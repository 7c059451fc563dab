// A stroke atlas cut from the strokes of footage. Wang et al. 2006, section 3, cut theirs by hand.
#pragma once

#include <span>
#include <vector>

#include "core/Image.h"
#include "matte/RainStrokes.h"
#include "matte/StrokeAtlas.h"

namespace virga::matte {

struct CutAtlasOptions {
    int count = 64;               // at most so many
    int width = 16, height = 64;  // of a tile [texels]; 0 = the medians of the strokes' own, in steps of 4, so that
                                  // half of them keep all their detail: 4..64, 16..256
    double acrossWidths = 2.5;    // tile width / stroke width (at least 1.5 px), 1..16
    float exposure = 0;           // of the footage [s], 0 unknown
};

/// The best by score, best first: those whole inside their frame, no two of which overlap in one frame, and none that
/// is seen again in the frame before or after, within 6 px and alike in size and contrast: rain does not stand still.
std::vector<RainStroke> bestStrokes(std::span<const RainStroke> strokes, int count);

/// How much of the picture a stroke's tile shows [px]: acrossWidths strokes across; along, the stroke and half a width
/// (at least 1 px) beyond either end.
struct TileExtent {
    double across, along;
};
TileExtent tileExtent(const RainStroke& stroke, double acrossWidths) noexcept;

/// One stroke, upright, in units of alpha: less its background, masked to its own reach, faded to 0 over the outer
/// tenth of the tile's width and the outer half of the margin at its ends. Each texel is the mean of the alpha
/// (interpolated cubically) over the texel's area, so that sum x texel area is the stroke's mass at any size. Values
/// may be slightly below 0 where there is noise.
ImageF cutStroke(const ImageF& alpha, const RainStroke& stroke, int width, int height, double acrossWidths);

/// The finished atlas (finishAtlas: peaks of 1) of the best strokes, one group, with lengthPixels, widthPixels,
/// lengthDiameters and exposure filled; fewer strokes make fewer layers. Reductions of a tile are exact by the atlas's
/// integrals; no mipmaps are kept.
/// Throws Error(Input) if there is no stroke to cut, Error(InvalidArgument) naming an option out of range.
StrokeAtlas cutAtlas(std::span<const ImageF> alphas, std::span<const RainStroke> strokes,
                     const CutAtlasOptions& options);

/// The same of all the strokes given, in their order.
StrokeAtlas atlasOf(std::span<const ImageF> alphas, std::span<const RainStroke> best, const CutAtlasOptions& options);

/// A stroke with as much of its alpha as its tile shows: what is kept of it when the frame goes.
struct KeptStroke {
    RainStroke stroke;  // frame 0, place in `alpha`
    ImageF alpha;
};
KeptStroke keepStroke(const ImageF& alpha, const RainStroke& stroke, double acrossWidths);

}  // namespace virga::matte
