#include "InfoColor.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "io/ColorConversion.h"

namespace virga::cli {

using nlohmann::json;

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
