#include "shot/AtlasFile.h"

#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>

#include "core/Error.h"
#include "io/Plate.h"
#include "matte/AtlasSheet.h"
#include "matte/OscillatingDrops.h"

namespace virga::shot {

matte::StrokeAtlas builtInAtlas(std::uint32_t seed) { return matte::makeOscillatingDropAtlas(seed); }

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
