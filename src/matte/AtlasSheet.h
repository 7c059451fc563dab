// Stroke atlases from and to pictures. Reading and writing the files is io's; here are the pixels and the text beside
// them. What a tile means (which end is up, what its width stands for) is in StrokeAtlas.h.
//
// Three layouts are read:
//   a sheet with a JSON text beside it   tiles in rows from the top left, `columns` to a row, the last row may be short
//   a sheet without                      16x64 tiles; width and height must be multiples of 16 and 64
//   one picture a stroke                 upright, any sizes; empty margins are cut off, and all are resampled to one
//   size
// The matte is the picture's alpha if it has one that is not the same everywhere, else its luminance (Rec.709 weights;
// 1 channel: the value itself; 2 channels: luminance and alpha). Values below 0 count as 0; each tile is scaled to a
// peak of 1. An empty tile is left out with a warning.
//
// The JSON: {"format": "virga-stroke-atlas", "version": 1,
//   "tile_width": 16, "tile_height": 64, "columns": 8, "count": 96,       the four that must be there
//   "across_diameters": 1.25,                                             tile width in drop diameters
//   "groups": 12, "first_bead_cycles": 0.25, "groups_per_octave": 2,      only if groups * variants = count
//   "strokes": [{"length_px", "width_px", "exposure_s", "bead_cycles", "length_diameters", "min_diameter_mm",
//                "max_diameter_mm"}, ...]}                                one a tile; each field may be absent
//                (unknown)
// Unknown fields are ignored, so that whoever writes an atlas may keep notes of their own in it.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "matte/StrokeAtlas.h"

namespace virga::matte {

/// The atlas in a sheet of tiles. `json`: the text beside it, none for the 16x64 layout. `name`: what errors call it.
/// Throws Error(Input) naming what does not fit: a size that is not a multiple, a field that is missing or of the wrong
/// kind, a count that the sheet does not hold, a value that is not finite, all tiles empty.
StrokeAtlas atlasFromSheet(ConstImageViewF sheet, std::optional<std::string_view> json, std::string_view name);

/// The atlas of single strokes. The common size is the largest width and height among them after trimming, at least
/// 4x16 and at most 64x256; area-averaged where that is smaller, interpolated where it is larger.
/// Throws Error(Input) as above.
StrokeAtlas atlasFromStrokes(const std::vector<ConstImageViewF>& strokes, std::string_view name);

/// All tiles in one picture, one channel, `columns` to a row (the group size if 0).
ImageF atlasSheet(const StrokeAtlas& atlas, int columns = 0);

/// The JSON that goes with atlasSheet(atlas, columns). atlasFromSheet(sheet, json) gives the atlas back: the texels bit
/// for bit, the numbers to float precision.
std::string atlasJson(const StrokeAtlas& atlas, int columns = 0);

}  // namespace virga::matte
