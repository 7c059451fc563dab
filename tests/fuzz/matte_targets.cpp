#include <cmath>

#include "fuzz/Targets.h"
#include "matte/AtlasSheet.h"

namespace virga::fuzz {

namespace {

/// A sheet of 8 tiles of 16x64, the fourth empty.
ImageF sheet()
{
    ImageF pixels(64, 128, 1);
    for (int y = 0; y < 128; ++y)
        for (int x = 0; x < 64; ++x) pixels.at(x, y) = y < 64 && x >= 48 ? 0.0f : float((x * 7 + y * 3) % 11) / 10;
    return pixels;
}

/// The text beside a sheet of strokes.
void takeAtlas(std::string_view input)
{
    static const ImageF pixels = sheet();
    answers({ErrorCode::Input}, [&] {
        const matte::StrokeAtlas atlas = matte::atlasFromSheet(pixels, input, "sheet");
        require(atlas.width > 0 && atlas.height > 0 && atlas.count() > 0, "an atlas has tiles");
        require(atlas.groups * atlas.variants == atlas.count(), "groups and variants are all of the tiles");
        require(std::isfinite(atlas.acrossDiameters) && std::isfinite(atlas.firstBeadCycles) &&
                    std::isfinite(atlas.groupsPerOctave),
                "what is said of the atlas is finite");
        for (const matte::StrokeMatte& stroke : atlas.mattes)
            for (const float value : {stroke.beadCycles, stroke.lengthDiameters, stroke.minDiameter, stroke.maxDiameter,
                                      stroke.mass, stroke.lengthPixels, stroke.widthPixels, stroke.exposure})
                require(std::isfinite(value), "what is said of a stroke is finite");
        for (const float value : atlas.summedArea) require(std::isfinite(value), "the sums are finite");
    });
}

}  // namespace

std::vector<Target> matteTargets()
{
    return {{"atlas",
             takeAtlas,
             {R"({"format": "virga-stroke-atlas", "version": 1, "tile_width": 16, "tile_height": 64, "columns": 4,
                  "count": 8, "across_diameters": 1.25, "strokes": [{"length_px": 40, "width_px": 3,
                  "exposure_s": 0.01, "bead_cycles": 0.5, "length_diameters": 30, "min_diameter_mm": 0.5,
                  "max_diameter_mm": 4}, {}]})",
              R"({"tile_width": 16, "tile_height": 64, "columns": 2, "count": 2, "groups": 2,
                  "first_bead_cycles": 0.25, "groups_per_octave": 2})"},
             {"tile_width", "tile_height", "columns", "count", "groups", "strokes", "bead_cycles", "null", "1e9", "-1",
              "[", "{"}}};
}

}  // namespace virga::fuzz
