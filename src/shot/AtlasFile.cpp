#include "shot/AtlasFile.h"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>

#include "core/Error.h"
#include "core/KeptInMemory.h"
#include "io/Plate.h"
#include "matte/AtlasSheet.h"
#include "matte/OscillatingDrops.h"

namespace virga::shot {

namespace {

constexpr const char* kind = "mattes";

/// What makes an atlas, without what finishAtlas derives.
struct Head {
    int width, height, groups, variants, count;
    float acrossDiameters, firstBeadCycles, groupsPerOctave;
};

std::string packed(const matte::StrokeAtlas& atlas)
{
    const Head head{atlas.width,   atlas.height,          atlas.groups,          atlas.variants,
                    atlas.count(), atlas.acrossDiameters, atlas.firstBeadCycles, atlas.groupsPerOctave};
    std::string bytes(reinterpret_cast<const char*>(&head), sizeof head);
    bytes.append(reinterpret_cast<const char*>(atlas.mattes.data()), atlas.mattes.size() * sizeof(matte::StrokeMatte));
    return bytes.append(reinterpret_cast<const char*>(atlas.layers.data()), atlas.layers.size() * sizeof(float));
}

matte::StrokeAtlas unpacked(const std::string& bytes)
{
    Head head{};
    std::memcpy(&head, bytes.data(), sizeof head);
    matte::StrokeAtlas atlas;
    atlas.width = head.width, atlas.height = head.height, atlas.groups = head.groups, atlas.variants = head.variants;
    atlas.acrossDiameters = head.acrossDiameters;
    atlas.firstBeadCycles = head.firstBeadCycles, atlas.groupsPerOctave = head.groupsPerOctave;
    atlas.mattes.resize(std::size_t(head.count));
    atlas.layers = ImageF(head.width, head.height * head.count, 1);
    const std::size_t mattesBytes = atlas.mattes.size() * sizeof(matte::StrokeMatte);
    std::memcpy(atlas.mattes.data(), bytes.data() + sizeof head, mattesBytes);
    std::memcpy(atlas.layers.data(), bytes.data() + sizeof head + mattesBytes, atlas.layers.size() * sizeof(float));
    matte::finishAtlas(atlas);
    return atlas;
}

}  // namespace

matte::StrokeAtlas builtInAtlas(std::uint32_t seed)
{
    KeptInMemory* const memory = KeptInMemory::ofThread();
    const std::string key = std::to_string(seed);
    if (memory != nullptr)
        if (const std::optional<std::string> kept = memory->load(kind, key)) return unpacked(*kept);
    matte::StrokeAtlas made = matte::makeOscillatingDropAtlas(seed);
    if (memory != nullptr) memory->store(kind, key, packed(made));
    return made;
}

matte::StrokeAtlas loadAtlas(const std::string& path)
{
    if (io::isFramePattern(path)) {
        std::vector<ImageF> pictures;
        for (const FrameNumber frame : io::findFrames(path))
            pictures.push_back(io::readRawImage(io::framePath(path, frame)).pixels);
        if (pictures.empty()) throw Error(ErrorCode::Input, "mattes '{}': no file of that pattern exists", path);
        return matte::atlasFromStrokes({pictures.begin(), pictures.end()}, path);
    }
    if (!std::filesystem::exists(path)) throw Error(ErrorCode::Input, "mattes '{}': no such file", path);
    std::optional<std::string> json;
    if (std::ifstream file(std::filesystem::path(path).replace_extension(".json")); file) {
        std::ostringstream text;
        text << file.rdbuf();
        json = text.str();
    }
    const io::RawImage sheet = io::readRawImage(path);
    return matte::atlasFromSheet(sheet.pixels, json ? std::optional<std::string_view>(*json) : std::nullopt, path);
}

}  // namespace virga::shot
