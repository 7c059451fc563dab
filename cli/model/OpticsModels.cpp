#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

#include "model/Model.h"
#include "optics/Airlight.h"
#include "optics/DropOscillation.h"
#include "optics/DropShape.h"
#include "optics/DropTransfer.h"
#include "optics/Fresnel.h"

namespace virga::cli {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180;

// transfer

struct TransferFlags {
    double index = optics::waterIndex[1];
    int order = 16, terms = 0, bins = 180;
    bool paper = false;
    const CLI::Option* termsGiven = nullptr;
};

/// The middles of `bins` equal steps of the scattering angle [deg].
std::vector<double> binMiddles(int bins)
{
    std::vector<double> middles;
    middles.reserve(std::size_t(bins));
    for (int i = 0; i < bins; ++i) middles.push_back(180.0 * (i + 0.5) / bins);
    return middles;
}

/// Mean of D [1/sr] over each of `bins` equal steps of the scattering angle.
std::vector<double> binMeans(int bins, const optics::DropTransferOptions& options)
{
    if (bins == 0) return {};
    const std::vector<double> edges = steps(0, pi, bins + 1);
    std::vector<double> mean = optics::binEnergies(edges, options);
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] /= 2 * pi * (std::cos(edges[i]) - std::cos(edges[i + 1]));
    return mean;
}

std::vector<plot::Chart> transferCharts(const optics::DropTransferOptions& options, const std::vector<double>& f)
{
    constexpr int bins = 360;
    const std::vector<double> angle = binMiddles(bins);
    const std::string which =
        fmt::format("index {:g}, {}, {}", options.index,
                    options.model == optics::PathModel::Paper ? "unpolarised" : "s and p apart",
                    options.terms == 0 ? std::string("all paths") : fmt::format("{} paths", options.terms));
    plot::Chart lobe{
        .title = "What a drop does to light",
        .subtitle = which + "; means over half a degree",
        .x = {.label = "scattering angle θ [deg]; 0 is straight on", .low = 0, .high = 180, .tickStep = 30},
        .y = {.label = "D(θ) [1/sr]", .scale = plot::Scale::Logarithmic, .low = 1e-5, .high = 5}};
    static constexpr const char* path[] = {"1: reflected outside", "2: straight through", "3: one reflection inside",
                                           "4: two inside"};
    std::vector<double> before(bins, 0.0);
    for (int n = 1; n <= 4 && (options.terms == 0 || n <= options.terms); ++n) {
        optics::DropTransferOptions first = options;
        first.terms = n;
        const std::vector<double> sum = binMeans(bins, first);
        std::vector<double> alone(bins);
        for (std::size_t i = 0; i < alone.size(); ++i) {
            alone[i] = sum[i] - before[i];
            // What is left of a difference where the path has no light.
            if (alone[i] < 1e-12 * sum[i]) alone[i] = 0.0;
        }
        lobe.series.push_back({.name = path[n - 1], .x = angle, .y = alone, .dashed = true});
        before = sum;
    }
    lobe.series.push_back({.name = "all", .x = angle, .y = binMeans(bins, options), .color = "#1d2733"});

    plot::Chart bands{.title = "Zonal coefficients",
                      .subtitle = which,
                      .x = {.label = "band l", .low = 0},
                      .y = {.label = "|f_l|", .scale = plot::Scale::Logarithmic},
                      .series = {{.markers = f.size() <= 65}}};
    for (std::size_t l = 0; l < f.size(); ++l) {
        bands.series[0].x.push_back(double(l));
        bands.series[0].y.push_back(std::abs(f[l]));
    }

    plot::Chart paths{.title = "Light by path",
                      .subtitle = fmt::format("index {:g}; path 1 is the reflection outside, 2 straight through, "
                                              "3 the first rainbow",
                                              options.index),
                      .x = {.label = "path"},
                      .y = {.label = "share of the light", .scale = plot::Scale::Logarithmic}};
    for (const auto model : {optics::PathModel::Polarised, optics::PathModel::Paper}) {
        const bool isPaper = model == optics::PathModel::Paper;
        paths.series.push_back({.name = isPaper ? "unpolarised" : "s and p apart",
                                .x = steps(1, 20, 20),
                                .y = optics::energyByPath(20, {.index = options.index, .model = model}).share,
                                .markers = true,
                                .dashed = isPaper});
    }
    return {lobe, bands, paths};
}

Answer transfer(const TransferFlags& flags)
{
    constexpr int pathsOfAll = 100;  // as many energies are listed where all paths are summed
    constexpr int paperTerms = 9;
    const bool termsGiven = flags.termsGiven->count() > 0;
    const optics::DropTransferOptions options{
        .index = flags.index,
        .model = flags.paper ? optics::PathModel::Paper : optics::PathModel::Polarised,
        .terms = flags.paper && !termsGiven ? paperTerms : flags.terms};
    std::vector<double> f = optics::zonalCoefficients(std::max(flags.order, 1), options);
    const double g = f[1];
    f.resize(std::size_t(flags.order) + 1);
    const optics::PathEnergies energy = optics::energyByPath(options.terms == 0 ? pathsOfAll : options.terms, options);

    Answer answer;
    answer.object = {{"n", options.index},
                     {"model", flags.paper ? "unpolarised" : "polarised"},
                     {"terms", options.terms == 0 ? nlohmann::json("inf") : nlohmann::json(options.terms)},
                     {"order", flags.order},
                     {"g", g},
                     {"energy_beyond", energy.beyond},
                     {"f", f},
                     {"energy_by_path", energy.share},
                     {"angle_deg", binMiddles(flags.bins)},
                     {"D_per_sr", binMeans(flags.bins, options)}};
    answer.columns = {{.fields = {"f"}, .counter = "l"}, {.fields = {"energy_by_path"}, .counter = "path", .first = 1}};
    if (flags.bins > 0) answer.columns.push_back({.fields = {"angle_deg", "D_per_sr"}});
    answer.charts = [=] { return transferCharts(options, f); };
    return answer;
}

std::function<Answer()> addTransfer(CLI::App& command)
{
    const auto flags = std::make_shared<TransferFlags>();
    addNumber(command, "--n", flags->index, {1, 4, "", true}, "refractive index of the drop relative to the air");
    addWhole(command, "--order", flags->order, 0, 4096, "highest band l of f_l");
    flags->termsGiven =
        addWhole(command, "--terms", flags->terms, 1, optics::maxPathEnergies,
                 "how many paths are summed: 1 outside reflection, 2 straight through, 3 first rainbow", "inf", 0);
    addWhole(command, "--bins", flags->bins, 0, 7200, "means of D over so many equal steps of the angle");
    command.add_flag("--paper", flags->paper,
                     "reflectances averaged over polarisation before the path, 9 terms unless --terms says otherwise");
    return [flags] { return transfer(*flags); };
}

// fresnel

struct FresnelFlags {
    double index = optics::waterIndex[1];
    std::vector<double> angle_deg = steps(0, 90, 19);
};

/// Exactly 0 at 90 degrees, where cos(pi / 2) is not.
double cosineOf(double angle_deg) { return angle_deg == 90.0 ? 0.0 : std::cos(angle_deg * degree); }

std::vector<plot::Chart> fresnelCharts(const FresnelFlags& flags)
{
    plot::Chart chart{.title = "Reflection at the water's surface",
                      .subtitle = fmt::format("index {:g}; p is not reflected at {:.2f} degrees (Brewster)",
                                              flags.index, optics::brewsterAngle(flags.index) / degree),
                      .x = {.label = "angle of incidence [deg]", .low = 0, .high = 90, .tickStep = 15},
                      .y = {.label = "share of the power that is reflected", .low = 0, .high = 1},
                      .series = {{.name = "s, across the plane of incidence"},
                                 {.name = "p, in it"},
                                 {.name = "unpolarised", .dashed = true, .color = "#1d2733"}}};
    for (const double angle : steps(0, 90, 361)) {
        const optics::Fresnel r = optics::fresnel(cosineOf(angle), flags.index);
        for (std::size_t i = 0; i < 3; ++i) {
            chart.series[i].x.push_back(angle);
            chart.series[i].y.push_back(i == 0 ? r.s : i == 1 ? r.p : r.mean());
        }
    }
    return {chart};
}

Answer fresnelAnswer(const FresnelFlags& flags)
{
    std::vector<double> mean, s, p;
    for (const double angle : flags.angle_deg) {
        const optics::Fresnel r = optics::fresnel(cosineOf(angle), flags.index);
        mean.push_back(r.mean());
        s.push_back(r.s);
        p.push_back(r.p);
    }
    Answer answer;
    answer.object = {{"n", flags.index}, {"brewster_deg", optics::brewsterAngle(flags.index) / degree}};
    // Of the two media, light stays in the denser one.
    const double denser = std::max(flags.index, 1 / flags.index);
    answer.object["critical_deg"] = optics::criticalAngle(denser) / degree;
    answer.object["angle_deg"] = flags.angle_deg;
    answer.object["R"] = mean;
    answer.object["Rs"] = s;
    answer.object["Rp"] = p;
    answer.columns = {{.fields = {"angle_deg", "R", "Rs", "Rp"}}};
    answer.charts = [=] { return fresnelCharts(flags); };
    return answer;
}

std::function<Answer()> addFresnel(CLI::App& command)
{
    const auto flags = std::make_shared<FresnelFlags>();
    addNumber(command, "--n", flags->index, {0.1, 10},
              "index of the medium beyond over that before; 1/1.333 is out of water");
    addNumbers(command, "--angles", flags->angle_deg, {0, 90, "deg"}, "angles of incidence");
    return [flags] { return fresnelAnswer(*flags); };
}

// shape

std::vector<plot::Chart> shapeCharts(const std::vector<double>& radius_mm)
{
    plot::Chart outlines{.title = "Falling drops from the side",
                         .subtitle = "radius of the sphere of the same volume",
                         .x = {.label = "across [mm]"},
                         .y = {.label = "up [mm]"},
                         .equalScales = true};
    for (const double a : radius_mm) {
        const optics::DropShape drop(1e-3 * a);
        plot::Series& s = outlines.series.emplace_back(plot::Series{.name = fmt::format("{:g} mm", a)});
        for (const double theta : steps(0, 2 * pi, 361)) {
            const double r = 1e3 * drop.radius(theta);
            s.x.push_back(r * std::sin(theta));
            s.y.push_back(-r * std::cos(theta));
        }
    }
    const std::vector<double> diameter_mm = steps(0.1, 9, 90);
    plot::Chart flattening{
        .title = "Larger drops are flatter",
        .subtitle = "",
        .x = {.label = "diameter of the sphere of the same volume [mm]", .low = 0, .high = 9},
        .y = {.label = "height over width", .low = 0.4, .high = 1},
        .series = {{.name = "Beard & Chuang 1987", .x = diameter_mm},
                   {.name = "1.03 − 0.062 D/mm, Pruppacher & Beard 1970", .x = diameter_mm, .dashed = true}}};
    plot::Chart tones{.title = "Oscillations of a drop",
                      .subtitle = "Rayleigh 1879; during an exposure they bead the streak",
                      .x = {.label = "diameter [mm]", .scale = plot::Scale::Logarithmic},
                      .y = {.label = "frequency [Hz]", .scale = plot::Scale::Logarithmic},
                      .series = {{.name = "mode 2, oblate and prolate", .x = ratios(0.5, 9, 60)},
                                 {.name = "mode 3, pear-shaped", .x = ratios(0.5, 9, 60)}}};
    for (const double d : diameter_mm) {
        flattening.series[0].y.push_back(optics::DropShape(0.5e-3 * d).axisRatio());
        flattening.series[1].y.push_back(optics::meanAxisRatio(1e-3 * d));
    }
    for (std::size_t i = 0; i < 2; ++i)
        for (const double d : tones.series[i].x)
            tones.series[i].y.push_back(optics::oscillationFrequency(int(i) + 2, 1e-3 * d));
    return {outlines, flattening, tones};
}

Answer shape(const std::vector<double>& radius_mm)
{
    std::vector<double> ratio, volume, width, height, mean, f2, f3, damping2, damping3;
    for (const double a : radius_mm) {
        const optics::DropShape drop(1e-3 * a);
        const double diameter = 2e-3 * a;
        ratio.push_back(drop.axisRatio());
        volume.push_back(1e9 * drop.volume());
        width.push_back(1e3 * drop.width());
        height.push_back(1e3 * drop.height());
        mean.push_back(optics::meanAxisRatio(diameter));
        f2.push_back(optics::oscillationFrequency(2, diameter));
        f3.push_back(optics::oscillationFrequency(3, diameter));
        damping2.push_back(optics::oscillationDamping(2, diameter));
        damping3.push_back(optics::oscillationDamping(3, diameter));
    }
    Answer answer;
    answer.object = {{"radius_mm", radius_mm},
                     {"axis_ratio", ratio},
                     {"volume_mm3", volume},
                     {"width_mm", width},
                     {"height_mm", height},
                     {"axis_ratio_pruppacher_beard", mean},
                     {"oscillation_mode2_Hz", f2},
                     {"oscillation_mode3_Hz", f3},
                     {"damping_mode2_per_s", damping2},
                     {"damping_mode3_per_s", damping3}};
    answer.columns = {
        {.fields = {"radius_mm", "axis_ratio", "axis_ratio_pruppacher_beard", "volume_mm3", "width_mm", "height_mm"}},
        {.fields = {"radius_mm", "oscillation_mode2_Hz", "oscillation_mode3_Hz", "damping_mode2_per_s",
                    "damping_mode3_per_s"}}};
    answer.charts = [=] { return shapeCharts(radius_mm); };
    return answer;
}

std::function<Answer()> addShape(CLI::App& command)
{
    const auto radii = std::make_shared<std::vector<double>>(std::vector<double>{0.5, 1, 1.5, 2, 2.5, 3, 4.5});
    addNumbers(command, "--radii", *radii, {0, 10, "mm", true}, "radii of the spheres of the same volume");
    return [radii] { return shape(*radii); };
}

// airlight

struct AirlightFlags {
    double extinction = 0.01, distance = 20, surface = std::numeric_limits<double>::infinity();
    std::vector<double> angle_deg{0.25, 0.5, 1, 2, 5, 10, 20, 45, 90, 180};
};

double airlightAt(const AirlightFlags& flags, double angle_deg)
{
    const double angle = angle_deg * degree;
    // Straight away from the lamp the ray does pass through it, behind the camera.
    const double across = angle_deg == 180.0 ? 0.0 : flags.distance * std::sin(angle);
    return optics::airlight(flags.distance * std::cos(angle), across, flags.surface, flags.extinction);
}

std::vector<plot::Chart> airlightCharts(const AirlightFlags& flags)
{
    plot::Chart chart{.title = "The glow of a lamp in rain",
                      .subtitle = fmt::format("lamp at {:g} m, per unit of radiant intensity", flags.distance),
                      .x = {.label = "angle from the lamp [deg]", .scale = plot::Scale::Logarithmic},
                      .y = {.label = "airlight [1/m²]", .scale = plot::Scale::Logarithmic}};
    for (const double factor : {0.1, 1.0, 10.0}) {
        AirlightFlags other = flags;
        other.extinction *= factor;
        plot::Series& s = chart.series.emplace_back(
            plot::Series{.name = fmt::format("extinction {:g} /m", other.extinction), .x = ratios(0.1, 180, 120)});
        for (const double angle : s.x) s.y.push_back(airlightAt(other, angle));
    }
    return {chart};
}

Answer airlight(const AirlightFlags& flags)
{
    std::vector<double> light;
    for (const double angle : flags.angle_deg) light.push_back(airlightAt(flags, angle));
    Answer answer;
    answer.object = {{"extinction_per_m", flags.extinction}, {"distance_m", flags.distance}};
    if (std::isfinite(flags.surface)) answer.object["surface_m"] = flags.surface;
    answer.object["angle_deg"] = flags.angle_deg;
    answer.object["airlight_per_m2"] = light;
    answer.columns = {{.fields = {"angle_deg", "airlight_per_m2"}}};
    answer.charts = [=] { return airlightCharts(flags); };
    return answer;
}

std::function<Answer()> addAirlight(CLI::App& command)
{
    const auto flags = std::make_shared<AirlightFlags>();
    addNumber(command, "--extinction", flags->extinction, {0, 100, "1/m"}, "extinction coefficient of the rain");
    addNumber(command, "--distance", flags->distance, {0, 1e6, "m", true}, "from the camera to the lamp");
    addNumber(command, "--surface", flags->surface, {0, 1e9, "m", true}, "along the ray to what is behind");
    addNumbers(command, "--angles", flags->angle_deg, {0, 180, "deg", true}, "between the ray and the lamp");
    return [flags] { return airlight(*flags); };
}

}  // namespace

std::vector<Model> opticsModels()
{
    return {{"transfer", "the drop's transfer function: zonal coefficients, light by path",
             "Examples:\n"
             "  virga model transfer --order 64 --json\n"
             "  virga model transfer --n 1.338 --terms 3 --plot blue.svg\n"
             "  virga model transfer --paper",
             addTransfer},
            {"fresnel", "reflection at the water's surface",
             "Examples:\n"
             "  virga model fresnel --angles 0,53.12,90\n"
             "  virga model fresnel --n 0.75 --plot inside.svg",
             addFresnel},
            {"shape", "shapes of falling drops, their oscillations",
             "Examples:\n"
             "  virga model shape --radii 0.5,1,3\n"
             "  virga model shape --plot drops.svg",
             addShape},
            {"airlight", "the glow of a lamp in rain or mist",
             "Examples:\n"
             "  virga model airlight --extinction 0.02 --distance 10\n"
             "  virga model airlight --surface 15 --angles 1,10,90 --json",
             addAirlight}};
}

}  // namespace virga::cli
