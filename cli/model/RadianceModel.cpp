#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <system_error>

#include "core/Error.h"
#include "environment/DropRadiance.h"
#include "model/Model.h"
#include "shot/PanoramaFile.h"

namespace virga::cli {
namespace {

using Json = nlohmann::json;

struct RadianceFlags {
    std::string panorama, directions;
    int order = environment::DropRadianceOptions::autoOrder;
    bool paper = false;
};

/// The share of the background that Wang et al. add: C + 0.7 B, Eq. (2).
constexpr double paperBackground = 0.7;

/// [[x, y, z], ...], by itself or under "directions" or "view"; of any length but 0. Unit vectors.
std::vector<glm::dvec3> readDirections(const std::string& path)
{
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored))
        throw Error(ErrorCode::Input, "--directions '{}': is a folder, not a file", path);
    std::ifstream file(path);
    if (!file) throw Error(ErrorCode::Input, "--directions '{}': cannot be opened", path);
    Json object;
    try {
        object = Json::parse(file);
    } catch (const Json::exception&) {
        throw Error(ErrorCode::Input, "--directions '{}': is not JSON; it must hold a list of [x, y, z]", path);
    }
    if (object.is_object()) {
        for (const char* name : {"directions", "view"}) {
            if (!object.contains(name)) continue;
            const Json inner = object[name];
            object = inner;
            break;
        }
    }
    if (!object.is_array() || object.empty())
        throw Error(ErrorCode::Input, "--directions '{}': must hold a list of [x, y, z], by itself or as 'directions'",
                    path);
    std::vector<glm::dvec3> directions;
    for (const Json& entry : object) {
        glm::dvec3 v(0.0);
        bool isVector = entry.is_array() && entry.size() == 3;
        for (std::size_t i = 0; i < 3 && isVector; ++i) {
            isVector = entry[i].is_number();
            if (isVector) v[int(i)] = entry[i].get<double>();
        }
        // By its largest part first: the square of what is tiny or huge may be no number.
        const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
        if (!isVector || !std::isfinite(largest) || !(largest > 0))
            throw Error(ErrorCode::Input, "--directions '{}', entry {}: {} must be [x, y, z], finite and not all 0",
                        path, directions.size(), entry.dump().substr(0, 80));
        directions.push_back(glm::normalize(v / largest));
    }
    return directions;
}

Json rgb(const glm::dvec3& c) { return Json::array({c.r, c.g, c.b}); }

Answer radiance(const RadianceFlags& flags)
{
    const std::vector<glm::dvec3> directions = readDirections(flags.directions);
    environment::DropRadianceOptions options;
    options.order = flags.order;
    options.paper = flags.paper;
    const environment::Panorama panorama = shot::readPanorama(flags.panorama);
    const environment::DropRadianceBaker baker(options);
    const environment::DropRadiance light = baker.bake(panorama);

    Json stroke = Json::array(), drop = Json::array(), background = Json::array(), view = Json::array();
    plot::Chart chart{.title = "What drops return",
                      .subtitle = fmt::format("{}, order {}{}", flags.panorama, light.order,
                                              flags.paper ? ", as Wang et al. 2006" : ""),
                      .x = {.label = "direction, as listed"},
                      .y = {.label = "radiance"},
                      .series = {{.name = "red", .markers = true, .line = false, .color = "#c8393a"},
                                 {.name = "green", .markers = true, .line = false, .color = "#2f8f46"},
                                 {.name = "blue", .markers = true, .line = false, .color = "#2f62b8"}}};
    for (const glm::dvec3& v : directions) {
        const glm::dvec3 c = baker.exactly(light, v), b = environment::sampleMap(panorama.pixels, v);
        const glm::dvec3 sum = flags.paper ? c + paperBackground * b : c;
        view.push_back(Json::array({v.x, v.y, v.z}));
        stroke.push_back(rgb(sum));
        drop.push_back(rgb(c));
        background.push_back(rgb(b));
        for (std::size_t i = 0; i < 3; ++i) {
            chart.series[i].x.push_back(double(chart.series[i].x.size()));
            chart.series[i].y.push_back(sum[int(i)]);
        }
    }
    Answer answer;
    answer.object = {{"order", light.order},         {"lights", light.lights.size()},
                     {"remainder", light.remainder}, {"direction", view},
                     {"radiance", stroke},           {"drop", drop},
                     {"background", background}};
    answer.columns = {{.fields = {"direction", "radiance", "background"}, .counter = "entry"}};
    answer.charts = [chart] { return std::vector<plot::Chart>{chart}; };
    return answer;
}

std::function<Answer()> addRadiance(CLI::App& command)
{
    const auto flags = std::make_shared<RadianceFlags>();
    command.add_option("--env", flags->panorama, "an equirectangular panorama")->required()->type_name("FILE");
    command.add_option("--directions", flags->directions, "a JSON list of [x, y, z], camera to drop")
        ->required()
        ->type_name("FILE");
    addWhole(command, "--order", flags->order, 0, environment::DropRadianceOptions::maxOrder, "order of the harmonics",
             "auto", environment::DropRadianceOptions::autoOrder);
    command.add_flag(
        "--paper", flags->paper,
        "Wang et al. 2006: order 3 unless --order says otherwise, and 0.7 of what is behind the drop added");
    return [flags] { return radiance(*flags); };
}

}  // namespace

std::vector<Model> radianceModels()
{
    return {{"radiance", "what drops return of a panorama",
             "Examples:\n"
             "  virga model radiance --env street.exr --directions views.json --json\n"
             "  virga model radiance --env street.exr --directions views.json --order 16 --paper\n"
             "views.json holds [[0, 0, -1], [1, 0, 0]]: world axes, +y up, the panorama's centre at -z.",
             addRadiance}};
}

}  // namespace virga::cli
