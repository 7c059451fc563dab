#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "model/Model.h"
#include "rainfall/DropSizes.h"
#include "rainfall/TerminalSpeed.h"

namespace virga::cli {
namespace {

using rainfall::DropSizes;

// velocity

std::vector<plot::Chart> velocityCharts()
{
    plot::Chart chart{
        .title = "How fast drops fall",
        .subtitle = "still air at sea level",
        .x = {.label = "diameter [mm]", .low = 0, .high = 8},
        .y = {.label = "terminal speed [m/s]", .low = 0, .high = 10},
        .series = {
            {.name = "through Gunn & Kinzer's measurements, 1949", .x = steps(0, 8, 321)},
            {.name = "9.65 − 10.3 exp(−0.6 D/mm), Atlas et al. 1973", .x = steps(0.11, 8, 321), .dashed = true}}};
    for (const double d : chart.series[0].x) chart.series[0].y.push_back(rainfall::terminalSpeed(1e-3 * d));
    for (const double d : chart.series[1].x) chart.series[1].y.push_back(9.65 - 10.3 * std::exp(-0.6 * d));
    return {chart};
}

Answer velocity(const std::vector<double>& diameter_mm)
{
    std::vector<double> speed;
    speed.reserve(diameter_mm.size());
    for (const double d : diameter_mm) speed.push_back(rainfall::terminalSpeed(1e-3 * d));
    Answer answer;
    answer.object = {{"diameter_mm", diameter_mm}, {"speed_m_s", speed}};
    answer.columns = {{.fields = {"diameter_mm", "speed_m_s"}}};
    answer.charts = [=] { return velocityCharts(); };
    return answer;
}

std::function<Answer()> addVelocity(CLI::App& command)
{
    const auto diameters =
        std::make_shared<std::vector<double>>(std::vector<double>{0.1, 0.2, 0.5, 1, 1.5, 2, 3, 4, 5, 6, 8});
    addNumbers(command, "--diameters", *diameters, {0, 20, "mm"}, "diameters of the spheres of the same volume");
    return [diameters] { return velocity(*diameters); };
}

// sizes and extinction

struct RainFlags {
    double rate_mm_h = 25, efficiency = 2;
    bool marshallPalmer = false;

    DropSizes sizes() const { return marshallPalmer ? DropSizes::marshallPalmer(rate_mm_h) : DropSizes(rate_mm_h); }
    const char* law() const { return marshallPalmer ? "Marshall-Palmer, N0 = 8000" : "Marshall-Palmer, rate kept"; }
};

void addRainFlags(CLI::App& command, RainFlags& flags)
{
    addNumber(command, "--rate", flags.rate_mm_h, {0, 2000, "mm/h"}, "how much rain falls");
    command.add_flag(
        "--marshall-palmer", flags.marshallPalmer,
        "N0 = 8000 /(m^3 mm) and diameters without end, as published, instead of the N0 that gives the rate");
}

std::vector<plot::Chart> sizesCharts(const RainFlags& flags)
{
    const std::string rate = fmt::format("{:g} mm/h", flags.rate_mm_h);
    const DropSizes published = DropSizes::marshallPalmer(flags.rate_mm_h), ours(flags.rate_mm_h);
    const std::vector<double> diameter_mm = steps(0, 8, 161);
    plot::Chart numbers{.title = "How many drops of which size",
                        .subtitle = rate,
                        .x = {.label = "diameter D [mm]", .low = 0, .high = 8},
                        .y = {.label = "N(D) [1/(m³ mm)]", .scale = plot::Scale::Logarithmic, .low = 1e-3, .high = 2e4},
                        .series = {{.name = "the N₀ that gives the rate", .x = diameter_mm},
                                   {.name = "N₀ = 8000, Marshall & Palmer 1948", .x = diameter_mm, .dashed = true}}};
    plot::Chart rain{.title = "Which drops bring the rain",
                     .subtitle = fmt::format("{}; with measured fall speeds N₀ = 8000 brings {:.2f} mm/h", rate,
                                             published.impliedRate_mm_h()),
                     .x = {.label = "diameter D [mm]", .low = 0, .high = 8},
                     .y = {.label = "rain by diameter [mm/h per mm]", .low = 0},
                     .series = numbers.series};
    for (const double d_mm : diameter_mm) {
        const double d = 1e-3 * d_mm;
        const double each = 3.6e6 * std::numbers::pi / 6 * d * d * d * rainfall::terminalSpeed(d);  // per drop in 1/m^3
        for (std::size_t i = 0; i < 2; ++i) {
            const double density = 1e-3 * (i == 0 ? ours : published).density(d);
            numbers.series[i].y.push_back(density);
            rain.series[i].y.push_back(each * density);
        }
    }
    return {numbers, rain};
}

Answer sizesAnswer(const RainFlags& flags)
{
    const DropSizes sizes = flags.sizes();
    const double number = sizes.numberPerVolume();
    Answer answer;
    answer.object = {{"rate_mm_h", flags.rate_mm_h},
                     {"law", flags.law()},
                     {"lambda_per_mm", 1e-3 * sizes.slope()},
                     {"n0_per_m3_mm", 1e-3 * sizes.intercept()},
                     {"number_per_m3", number},
                     {"number_over_0.5mm_per_m3", sizes.numberPerVolume(0.5e-3)},
                     {"number_over_1mm_per_m3", sizes.numberPerVolume(1e-3)},
                     {"number_over_2mm_per_m3", sizes.numberPerVolume(2e-3)},
                     {"mean_diameter_mm", number > 0 ? 1e3 * sizes.moment(1) / number : 0.0},
                     {"median_volume_diameter_mm", 1e3 * sizes.medianVolumeDiameter()},
                     {"liquid_water_g_m3", 1e3 * sizes.liquidWater()},
                     {"implied_rate_mm_h", sizes.impliedRate_mm_h()},
                     {"impacts_per_m2_s", sizes.impactsPerAreaAndTime()}};
    if (!flags.marshallPalmer) answer.object["largest_diameter_mm"] = 1e3 * sizes.largestDiameter();
    answer.charts = [=] { return sizesCharts(flags); };
    return answer;
}

/// Distance [m] at which a black thing keeps 5 % of its contrast against the sky. Koschmieder 1924.
double visibility(double extinction) { return std::log(20.0) / extinction; }

std::vector<plot::Chart> extinctionCharts(const RainFlags& flags)
{
    const std::vector<double> rate = ratios(0.1, 200, 100);
    plot::Chart coefficient{.title = "How rain dims what is behind it",
                            .subtitle = fmt::format("efficiency Q = {:g}{}", flags.efficiency,
                                                    flags.efficiency == 2   ? ", diffracted light is lost"
                                                    : flags.efficiency == 1 ? ", the drops' shadows alone"
                                                                            : ""),
                            .x = {.label = "rain rate [mm/h]", .scale = plot::Scale::Logarithmic},
                            .y = {.label = "extinction coefficient [1/m]", .scale = plot::Scale::Logarithmic},
                            .series = {{.name = "the N₀ that gives the rate", .x = rate},
                                       {.name = "N₀ = 8000, Marshall & Palmer 1948", .x = rate, .dashed = true}}};
    plot::Chart sight = coefficient;
    sight.title = "How far one sees in rain";
    sight.subtitle += "; 5 % of the contrast left (Koschmieder 1924)";
    sight.y.label = "visibility [m]";
    for (const double r : rate) {
        const double ours = DropSizes(r).extinction(flags.efficiency);
        const double published = DropSizes::marshallPalmer(r).extinction(flags.efficiency);
        coefficient.series[0].y.push_back(ours);
        coefficient.series[1].y.push_back(published);
        sight.series[0].y.push_back(visibility(ours));
        sight.series[1].y.push_back(visibility(published));
    }
    return {coefficient, sight};
}

Answer extinctionAnswer(const RainFlags& flags)
{
    const double extinction = flags.sizes().extinction(flags.efficiency);
    Answer answer;
    answer.object = {{"rate_mm_h", flags.rate_mm_h},
                     {"law", flags.law()},
                     {"efficiency", flags.efficiency},
                     {"extinction_per_m", extinction}};
    if (extinction > 0) answer.object["visibility_m"] = visibility(extinction);
    answer.charts = [=] { return extinctionCharts(flags); };
    return answer;
}

std::function<Answer()> addSizes(CLI::App& command)
{
    const auto flags = std::make_shared<RainFlags>();
    addRainFlags(command, *flags);
    return [flags] { return sizesAnswer(*flags); };
}

std::function<Answer()> addExtinction(CLI::App& command)
{
    const auto flags = std::make_shared<RainFlags>();
    addRainFlags(command, *flags);
    addNumber(command, "--efficiency", flags->efficiency, {0, 10},
              "Q: 2 counts the light that drops diffract as lost, 1 is their shadow alone");
    return [flags] { return extinctionAnswer(*flags); };
}

}  // namespace

std::vector<Model> rainModels()
{
    return {{"velocity", "how fast drops fall",
             "Examples:\n"
             "  virga model velocity --diameters 0.5,1,2,5\n"
             "  virga model velocity --plot speed.svg",
             addVelocity},
            {"sizes", "how many drops of which size a cubic metre of rain holds",
             "Examples:\n"
             "  virga model sizes --rate 10\n"
             "  virga model sizes --rate 1 --marshall-palmer --json",
             addSizes},
            {"extinction", "how rain dims what is behind it",
             "Examples:\n"
             "  virga model extinction --rate 50\n"
             "  virga model extinction --rate 50 --efficiency 1 --plot sight.svg",
             addExtinction}};
}

}  // namespace virga::cli
