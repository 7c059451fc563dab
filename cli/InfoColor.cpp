#include "InfoColor.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/FrameRange.h"
#include "io/ColorConversion.h"
#include "io/Plate.h"

namespace virga::cli {

using nlohmann::json;

json plateReport(const std::string& file, const std::string& ocio)
{
    io::ReadOptions options;
    options.ocio = ocio;
    const auto reader = io::openPlate(file, options);
    const io::PlateInfo& info = reader->info();
    return {{"path", info.path},
            {"format", info.format},
            {"width", info.width},
            {"height", info.height},
            {"pixel_aspect", info.pixelAspect},
            {"alpha", info.hasAlpha},
            {"fps", info.fps},
            {"variable_rate", info.isVariableRate},
            {"scan", info.isMovie ? json(io::scanWords(info.scan)) : json()},
            {"layers", info.layers},
            {"views", info.views},
            {"beside", info.beside},
            {"video_streams", info.videoStreams},
            {"frames", info.frames.size()},
            {"frame_range", formatFrameRange(info.frames)},
            {"colorspace", info.colorspace},
            {"colorspace_source", info.colorspaceSource},
            {"working_colorspace", info.workingColorspace},
            {"ocio", info.colors->origin()}};
}

std::string plateText(const json& r)
{
    const auto text = [&](const char* key) { return r[key].get<std::string>(); };
    const std::size_t frames = r["frames"].get<std::size_t>();
    std::string streams;
    for (const json& layer : r["layers"]) streams += fmt::format("  --layer       {}\n", layer.get<std::string>());
    for (const json& view : r["views"]) streams += fmt::format("  --view        {}\n", view.get<std::string>());
    if (const json& list = r["video_streams"]; list.size() > 1)
        for (std::size_t i = 0; i < list.size(); ++i)
            streams += fmt::format("  --stream {}    {}\n", i, list[i].get<std::string>());
    return fmt::format("{}\n", text("path")) +
           fmt::format("  picture       {} x {}{}, {}\n", r["width"].get<int>(), r["height"].get<int>(),
                       r["alpha"].get<bool>() ? " with alpha" : "", text("format")) +
           fmt::format("  frames        {} ({}), {:g} a second{}\n", frames, text("frame_range"),
                       r["fps"].get<double>(), r["variable_rate"].get<bool>() ? " on average" : "") +
           (r["scan"].is_null() ? std::string() : fmt::format("  scan          {}\n", text("scan"))) + streams +
           fmt::format("  colour space  {} ({})\n", text("colorspace"), text("colorspace_source")) +
           fmt::format("  worked on in  {}\n", text("working_colorspace")) +
           fmt::format("  configuration {}\n", text("ocio"));
}

json colorReport(const std::string& ocio)
{
    const auto config = io::ColorConfig::open(ocio);
    json spaces = json::array(), roles = json::object();
    for (const auto& space : config->spaces())
        spaces.push_back({{"name", space.name},
                          {"family", space.family},
                          {"aliases", space.aliases},
                          {"from", space.isUsers ? config->origin() : "built-in"}});
    for (const auto& [role, space] : config->roles()) roles[role] = space;
    return {{"ocio", config->origin()}, {"colorspaces", spaces}, {"roles", roles}};
}

std::string colorText(const json& report)
{
    std::string text = fmt::format("configuration: {}\n", report["ocio"].get<std::string>()), heading;
    for (const json& space : report["colorspaces"]) {
        const std::string from = space["from"].get<std::string>(), family = space["family"].get<std::string>();
        const std::string title = from + (family.empty() ? "" : ", " + family);
        if (title != heading) text += fmt::format("\n{}\n", title);
        heading = title;
        const auto aliases = space["aliases"].get<std::vector<std::string>>();
        text += fmt::format("  {:<32} {}\n", space["name"].get<std::string>(), fmt::join(aliases, ", "));
        while (text.ends_with(" \n")) text.erase(text.size() - 2, 1);
    }
    text += "\nroles\n";
    for (const auto& [role, space] : report["roles"].items())
        text += fmt::format("  {:<32} {}\n", role, space.get<std::string>());
    return text;
}

}  // namespace virga::cli
