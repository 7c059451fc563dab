#include "matte/AtlasSheet.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/Error.h"
#include "core/Log.h"
#include "core/Words.h"

namespace virga::matte {
namespace {

using nlohmann::json;

constexpr int kPlainTileWidth = 16, kPlainTileHeight = 64;  // Wang et al. 2006, table 2: 1,024 bytes a matte
constexpr float kMarginBelow = 1.0f / 255;                  // of the peak: what trimming takes for empty

// The picture's matte as the header says it, one channel, none below 0.
ImageF matteOf(ConstImageViewF picture, std::string_view name)
{
    const int channels = picture.channels();
    if (picture.empty() || channels < 1)
        throw Error(ErrorCode::Input, "stroke atlas '{}': the picture has no pixels", name);
    const int alpha = channels == 2 ? 1 : channels >= 4 ? 3 : -1;
    bool useAlpha = false;
    for (int y = 0; alpha >= 0 && y < picture.height() && !useAlpha; ++y)
        for (int x = 0; x < picture.width() && !useAlpha; ++x)
            useAlpha = picture.at(x, y, alpha) != picture.at(0, 0, alpha);

    ImageF matte(picture.width(), picture.height(), 1);
    for (int y = 0; y < picture.height(); ++y)
        for (int x = 0; x < picture.width(); ++x) {
            const float* p = picture.pixel(x, y);
            const float value = useAlpha       ? p[alpha]
                                : channels < 3 ? p[0]
                                               : 0.2126f * p[0] + 0.7152f * p[1] + 0.0722f * p[2];
            if (!std::isfinite(value))
                throw Error(ErrorCode::Input, "stroke atlas '{}': the value at ({}, {}) is not finite", name, x, y);
            matte.at(x, y) = std::max(value, 0.0f);
        }
    return matte;
}

float peakOf(ConstImageViewF tile)
{
    float peak = 0;
    for (int y = 0; y < tile.height(); ++y)
        peak = std::max(peak, *std::max_element(tile.row(y), tile.row(y) + tile.width()));
    return peak;
}

ConstImageViewF crop(ConstImageViewF image, int x, int y, int width, int height)
{
    return {image.pixel(x, y), width, height, 1, image.rowStride()};
}

ConstImageViewF trimmed(ConstImageViewF stroke)
{
    const float floor = kMarginBelow * peakOf(stroke);
    int left = stroke.width(), right = 0, top = stroke.height(), bottom = 0;
    for (int y = 0; y < stroke.height(); ++y)
        for (int x = 0; x < stroke.width(); ++x)
            if (stroke.at(x, y) > floor) {
                left = std::min(left, x), right = std::max(right, x + 1);
                top = std::min(top, y), bottom = std::max(bottom, y + 1);
            }
    return crop(stroke, left, top, right - left, bottom - top);
}

// Weights of the source samples for each target sample: a tent as wide as the coarser of the two grids, so that
// shrinking averages and growing interpolates. Edges repeat.
struct Taps {
    int first;
    std::vector<float> weights;
};
std::vector<Taps> tapsFor(int from, int to)
{
    const double scale = double(from) / to, reach = std::max(scale, 1.0);
    std::vector<Taps> taps(to);
    for (int i = 0; i < to; ++i) {
        const double centre = (i + 0.5) * scale - 0.5;
        taps[i].first = int(std::ceil(centre - reach));
        double sum = 0;
        for (int k = taps[i].first; k < centre + reach; ++k) {
            taps[i].weights.push_back(float(std::max(0.0, 1 - std::abs(k - centre) / reach)));
            sum += taps[i].weights.back();
        }
        for (float& w : taps[i].weights) w = float(w / sum);
    }
    return taps;
}

void resample(ConstImageViewF from, ImageView<float> to)
{
    const std::vector<Taps> across = tapsFor(from.width(), to.width()), along = tapsFor(from.height(), to.height());
    ImageF rows(to.width(), from.height(), 1, 0.0f);
    for (int y = 0; y < from.height(); ++y)
        for (int x = 0; x < to.width(); ++x)
            for (std::size_t k = 0; k < across[x].weights.size(); ++k)
                rows.at(x, y) +=
                    across[x].weights[k] * from.at(std::clamp(across[x].first + int(k), 0, from.width() - 1), y);
    for (int y = 0; y < to.height(); ++y) {
        std::fill_n(to.row(y), to.width(), 0.0f);
        for (std::size_t k = 0; k < along[y].weights.size(); ++k) {
            const float* source = rows.row(std::clamp(along[y].first + int(k), 0, from.height() - 1));
            for (int x = 0; x < to.width(); ++x) to.at(x, y) += along[y].weights[k] * source[x];
        }
    }
}

// Tiles (of one size, none empty) into a finished atlas of one group.
StrokeAtlas assemble(const std::vector<ConstImageViewF>& tiles, const std::vector<StrokeMatte>& mattes)
{
    StrokeAtlas atlas;
    atlas.width = tiles[0].width();
    atlas.height = tiles[0].height();
    atlas.variants = int(tiles.size());
    atlas.mattes = mattes;
    atlas.layers = ImageF(atlas.width, atlas.height * atlas.variants, 1);
    for (int n = 0; n < atlas.variants; ++n)
        for (int y = 0; y < atlas.height; ++y) std::copy_n(tiles[n].row(y), atlas.width, atlas.layer(n).row(y));
    return atlas;
}

// A number of the JSON object, or what stands for unknown.
template <class T>
T numberOr(const json& object, const char* field, T absent, std::string_view name)
{
    const auto at = object.find(field);
    if (at == object.end() || at->is_null()) return absent;
    if (!at->is_number())
        throw Error(ErrorCode::Input, "stroke atlas '{}': \"{}\" is {}, not a number", name, field,
                    shortened(at->dump()));
    const double value = at->get<double>();
    // Counts and sizes come from strangers: nothing near the ends of an int is meant.
    if (!(std::abs(value) < 1e9))
        throw Error(ErrorCode::Input, "stroke atlas '{}': \"{}\" is {}, out of range", name, field,
                    shortened(at->dump()));
    return T(value);
}

int sizeFrom(const json& object, const char* field, std::string_view name)
{
    const int value = numberOr(object, field, 0, name);
    if (value < 1) throw Error(ErrorCode::Input, "stroke atlas '{}': \"{}\" must be there and at least 1", name, field);
    return value;
}

StrokeMatte matteFrom(const json& object, std::string_view name)
{
    StrokeMatte matte;
    matte.beadCycles = numberOr(object, "bead_cycles", matte.beadCycles, name);
    matte.lengthDiameters = numberOr(object, "length_diameters", matte.lengthDiameters, name);
    matte.minDiameter = 1e-3f * numberOr(object, "min_diameter_mm", 1e3f * matte.minDiameter, name);
    matte.maxDiameter = 1e-3f * numberOr(object, "max_diameter_mm", 1e3f * matte.maxDiameter, name);
    matte.lengthPixels = numberOr(object, "length_px", 0.0f, name);
    matte.widthPixels = numberOr(object, "width_px", 0.0f, name);
    matte.exposure = numberOr(object, "exposure_s", 0.0f, name);
    return matte;
}

}  // namespace

StrokeAtlas atlasFromSheet(ConstImageViewF sheet, std::optional<std::string_view> text, std::string_view name)
{
    const ImageF matte = matteOf(sheet, name);
    int width = kPlainTileWidth, height = kPlainTileHeight, columns = 0, count = 0;
    json info = json::object();
    if (text) {
        info = json();
        if (!isNestedDeeper(*text)) info = json::parse(*text, nullptr, false);
        if (!info.is_object())
            throw Error(ErrorCode::Input, "stroke atlas '{}': the text beside the sheet is not a JSON object", name);
        width = sizeFrom(info, "tile_width", name);
        height = sizeFrom(info, "tile_height", name);
        columns = sizeFrom(info, "columns", name);
        count = sizeFrom(info, "count", name);
        const std::int64_t rows = (std::int64_t(count) + columns - 1) / columns;
        if (std::int64_t(columns) * width > matte.width() || rows * height > matte.height())
            throw Error(ErrorCode::Input,
                        "stroke atlas '{}': {} tiles of {}x{}, {} to a row, do not fit in {}x{} pixels", name, count,
                        width, height, columns, matte.width(), matte.height());
    } else {
        if (matte.width() % width != 0 || matte.height() % height != 0)
            throw Error(ErrorCode::Input,
                        "stroke atlas '{}': {}x{} pixels are not a whole number of {}x{} tiles, and no JSON says how "
                        "they lie",
                        name, matte.width(), matte.height(), width, height);
        columns = matte.width() / width;
        count = columns * (matte.height() / height);
    }

    const json strokes = info.contains("strokes") ? info["strokes"] : json::array();
    if (!strokes.is_array() || std::ranges::any_of(strokes, [](const json& s) { return !s.is_object(); }))
        throw Error(ErrorCode::Input, "stroke atlas '{}': \"strokes\" is not a list of objects", name);
    std::vector<ConstImageViewF> tiles;
    std::vector<StrokeMatte> mattes;
    for (int n = 0; n < count; ++n) {
        const ConstImageViewF tile = crop(matte, n % columns * width, n / columns * height, width, height);
        if (!(peakOf(tile) > 0)) continue;
        tiles.push_back(tile);
        mattes.push_back(std::size_t(n) < strokes.size() ? matteFrom(strokes[n], name) : StrokeMatte());
    }
    if (tiles.empty()) throw Error(ErrorCode::Input, "stroke atlas '{}': all {} tiles are empty", name, count);
    const int empty = count - int(tiles.size());
    if (empty > 0) log::warning("stroke atlas '{}': {} of {} tiles are empty and left out", name, empty, count);

    StrokeAtlas atlas = assemble(tiles, mattes);
    atlas.acrossDiameters = numberOr(info, "across_diameters", atlas.acrossDiameters, name);
    if (!(atlas.acrossDiameters >= 0.1f && atlas.acrossDiameters <= 100))
        throw Error(ErrorCode::Input, "stroke atlas '{}': \"across_diameters\" is {}, not 0.1..100", name,
                    atlas.acrossDiameters);
    // Groups hold only while every tile is in its place.
    const int groups = numberOr(info, "groups", 1, name);
    if (groups > 1 && empty == 0 && count % groups == 0) {
        atlas.groups = groups;
        atlas.variants = count / groups;
        atlas.firstBeadCycles = numberOr(info, "first_bead_cycles", atlas.firstBeadCycles, name);
        atlas.groupsPerOctave = numberOr(info, "groups_per_octave", atlas.groupsPerOctave, name);
        if (!(atlas.firstBeadCycles > 0) || !(atlas.groupsPerOctave > 0))
            throw Error(ErrorCode::Input,
                        "stroke atlas '{}': \"first_bead_cycles\" and \"groups_per_octave\" must be above 0", name);
    }
    finishAtlas(atlas);
    return atlas;
}

StrokeAtlas atlasFromStrokes(const std::vector<ConstImageViewF>& strokes, std::string_view name)
{
    std::vector<ImageF> mattes;
    int empty = 0, width = 4, height = 16;
    for (const ConstImageViewF& stroke : strokes) {
        ImageF matte = matteOf(stroke, name);
        if (!(peakOf(matte) > 0)) {
            ++empty;
            continue;
        }
        const ConstImageViewF kept = trimmed(matte);
        width = std::max(width, kept.width());
        height = std::max(height, kept.height());
        mattes.push_back(std::move(matte));
    }
    if (mattes.empty())
        throw Error(ErrorCode::Input, "stroke atlas '{}': all {} strokes are empty", name, strokes.size());
    if (empty > 0)
        log::warning("stroke atlas '{}': {} of {} strokes are empty and left out", name, empty, strokes.size());

    width = std::min(width, 64), height = std::min(height, 256);
    std::vector<ImageF> tiles;
    std::vector<StrokeMatte> infos;
    for (const ImageF& matte : mattes) {
        const ConstImageViewF kept = trimmed(matte);
        resample(kept, tiles.emplace_back(width, height, 1).view());
        infos.emplace_back().lengthPixels = float(kept.height());
        infos.back().widthPixels = float(kept.width());
    }
    StrokeAtlas atlas = assemble({tiles.begin(), tiles.end()}, infos);
    atlas.acrossDiameters = 1;  // trimmed to the stroke itself
    finishAtlas(atlas);
    return atlas;
}

ImageF atlasSheet(const StrokeAtlas& atlas, int columns)
{
    if (columns <= 0) columns = atlas.variants;
    const int rows = (atlas.count() + columns - 1) / columns;
    ImageF sheet(columns * atlas.width, rows * atlas.height, 1, 0.0f);
    for (int n = 0; n < atlas.count(); ++n)
        for (int y = 0; y < atlas.height; ++y)
            std::copy_n(atlas.layer(n).row(y), atlas.width,
                        sheet.pixel(n % columns * atlas.width, n / columns * atlas.height + y));
    return sheet;
}

std::string atlasJson(const StrokeAtlas& atlas, int columns)
{
    nlohmann::ordered_json info = {{"format", "virga-stroke-atlas"},
                                   {"version", 1},
                                   {"tile_width", atlas.width},
                                   {"tile_height", atlas.height},
                                   {"columns", columns > 0 ? columns : atlas.variants},
                                   {"count", atlas.count()},
                                   {"across_diameters", atlas.acrossDiameters}};
    if (atlas.groups > 1) {
        info["groups"] = atlas.groups;
        info["first_bead_cycles"] = atlas.firstBeadCycles;
        info["groups_per_octave"] = atlas.groupsPerOctave;
    }
    auto& strokes = info["strokes"] = nlohmann::ordered_json::array();
    for (const StrokeMatte& matte : atlas.mattes) {
        auto& stroke = strokes.emplace_back(nlohmann::ordered_json::object());
        if (matte.lengthPixels > 0) stroke["length_px"] = matte.lengthPixels;
        if (matte.widthPixels > 0) stroke["width_px"] = matte.widthPixels;
        if (matte.exposure > 0) stroke["exposure_s"] = matte.exposure;
        if (matte.beadCycles >= 0) stroke["bead_cycles"] = matte.beadCycles;
        if (matte.lengthDiameters > 0) stroke["length_diameters"] = matte.lengthDiameters;
        stroke["min_diameter_mm"] = 1e3f * matte.minDiameter;
        stroke["max_diameter_mm"] = 1e3f * matte.maxDiameter;
    }
    return info.dump(1) + "\n";
}

}  // namespace virga::matte
