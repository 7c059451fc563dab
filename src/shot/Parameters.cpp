#include "shot/Parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/Error.h"
#include "core/Words.h"

namespace virga::shot {
namespace {

using S = Settings;
constexpr double huge = 1e9;

// clang-format off
constexpr Parameter table[] = {
    {"rate", "rain", "mm/h", 0, 2000, "how much rain falls; 5 is light, 25 heavy, 80 a downpour", &S::rate_mm_h},
    {"strokes", "rain", "", 1, 2e7, "draw about this many visible strokes instead of as many as the rate has", &S::strokes},
    {"drop-size", "rain", "x", 0.05, 20, "multiplies every drop's diameter", &S::dropSize},
    {"speed", "rain", "x", 0, 100, "multiplies every drop's fall speed", &S::speed},
    {"wind", "rain", "m/s", -100, 100, "steady wind along world x,z", &S::wind_m_s},
    {"gust", "rain", "m/s", 0, 50, "rms of the wind's slow changes", &S::gust_m_s},
    {"turbulence", "rain", "m/s", 0, 20, "rms of a drop's own small changes of velocity", &S::turbulence_m_s},
    {"opacity", "rain", "x", 0, 100, "multiplies the strokes' opacity; 1 is what drops cover, the default what cameras make of it (docs/realism.md)", &S::opacity},
    {"near", "rain", "m", 0.01, 1e4, "no stroke nearer than this", &S::near_m},
    {"far", "rain", "m", 0.02, 1e6, "no rain beyond this, drawn or as fog", &S::far_m},
    {"threshold", "rain", "", 1e-5, 0.5, "least opacity of a stroke that is drawn; fainter ones are fog", &S::threshold, nullptr,
     "RMSE 0.065 of the plate's mean and FLIP 0.083 against every drop drawn, as --opacity 5 is not fog's; 0.0036 and 0.0065 at --opacity 1, where another seed is 0.0048 and 0.0057 away (virga bench curves --only threshold)"},
    {"thin", "rain", "", 0, 0.5, "strokes fainter than this are drawn in smaller number and denser, as far as they still overlap: the rain's mean, variance and spectrum stay; 0 draws each one", &S::thin},
    {"seed", "rain", "", 0, 4294967295.0, "another number, other drops", &S::seed},
    {"mattes", "rain", "", 0, 0, "stroke atlas to draw with (image, with or without a .json beside it)", &S::mattes},
    {"shutter", "camera", "deg", 0, 3600, "shutter angle; 360 is open for the whole frame; auto: 1/200 s, as a camera in daylight", &S::shutter_deg},
    {"exposure", "camera", "s", 0, 60, "how long the shutter is open, instead of its angle", &S::exposure_s},
    {"fov", "camera", "deg", 0.1, 179, "horizontal field of view; auto: the track's, else 60", &S::fov_deg},
    {"focus", "camera", "m", 0.05, 1e6, "distance in focus", &S::focus_m},
    {"fstop", "camera", "", 0.5, 1000, "aperture; large numbers keep near drops sharp", &S::fstop},
    {"sensor-width", "camera", "mm", 1, 200, "width of the sensor, for the blur of near drops", &S::sensorWidth_mm},
    {"camera", "camera", "", 0, 0, "camera track: Nuke .chan, a list of 4x4 matrices (text or JSON), or the folder of a COLMAP model in text (docs/camera.md); plate: the one in the headers of an EXR plate, which is taken without this flag if there is one; none", &S::camera},
    {"camera-scale", "camera", "", 1e-9, 1e9, "metres in one unit of the track", &S::cameraScale},
    {"camera-up", "camera", "", 0, 0, "which way is up in the track's world", &S::cameraUp, "y|z|-y|-z"},
    {"camera-offset", "camera", "", -1e15, 1e15, "added to the track's frame numbers", &S::cameraOffset},
    {"camera-order", "camera", "", 0, 0, "order in which a .chan's rotations are applied", &S::cameraOrder, "xyz|xzy|yxz|yzx|zxy|zyx"},
    {"camera-layout", "camera", "", 0, 0, "a matrix list's numbers stand row by row, or column by column", &S::cameraLayout, "row|column"},
    {"camera-matrix", "camera", "", 0, 0, "which way a matrix list's matrices go", &S::cameraMatrix, "camera-to-world|world-to-camera"},
    {"camera-axes", "camera", "", 0, 0, "a matrix list's cameras look down -z with y up (opengl), or along z with y down (opencv)", &S::cameraAxes, "opengl|opencv"},
    {"fps", "camera", "1/s", 1e-3, 1e5, "frames a second; auto: the plate's", &S::fps},
    {"first-frame", "camera", "", -1e15, 1e15, "number of a movie's first frame, or of an image; auto: 0, or the number in the image's name", &S::firstFrame},
    {"env", "light", "", 0, 0, "equirectangular panorama that lights the drops (EXR, HDR, PNG), or a sequence of them, blended between its frames; none: from the plate", &S::env},
    {"env-yaw", "light", "deg", -3600, 3600, "turns the panorama to the right", &S::envYaw_deg},
    {"env-pitch", "light", "deg", -360, 360, "tilts the panorama up, before it is turned", &S::envPitch_deg},
    {"env-gain", "light", "x", 0, 1e6, "multiplies the light of the environment", &S::envGain},
    {"env-order", "light", "", 0, 128, "order of the spherical harmonics; auto: the lowest that leaves out less than 0.5 %", &S::envOrder, nullptr,
     "a stroke's radiance is off by 0.43 % RMS, 1.3 % at most, from the exact integral; lit by the plate by 0.07 % and 0.18 % (virga bench curves --only light-order)"},
    {"env-frames", "light", "", 0, 64, "without a panorama: frames of the plate that light is made from, once; 0: each frame from itself", &S::envFrames},
    {"light-radiance", "light", "", 1e-6, 1e9, "radiance of lights that are clipped at white, in panorama and plate; auto: estimated", &S::lightRadiance},
    {"sky", "light", "", 0, 1e6, "radiance of the sky where the plate does not show it", &S::sky},
    {"lights", "light", "", 0, 0, "file with the lamps in the scene: drops near them shine, the air around them glows", &S::lights},
    {"background-boost", "light", "x", 0, 4, "adds back the background's detail, at no gain of energy", &S::backgroundBoost},
    {"paper", "light", "", 0, 0, "the light of Wang et al. 2006: order 3, nine terms, 0.7 of the background added", &S::paper},
    {"depth", "scene", "", 0, 0, "depth in metres: one image, a sequence (EXR, 16-bit PNG, TIFF) or a movie (docs/depth.md)", &S::depth},
    {"depth-scale", "scene", "", 1e-9, 1e9, "metres in one stored unit of depth", &S::depthScale},
    {"depth-offset", "scene", "", -huge, huge, "added after the scale; to inverse depth and disparity before they are turned over", &S::depthOffset},
    {"depth-kind", "scene", "", 0, 0, "what is stored: depth along the camera's axis, distance along the ray, inverse depth, or disparity in pixels", &S::depthKind, "z|distance|inverse|disparity"},
    {"depth-invert", "scene", "", 0, 0, "the same as --depth-kind inverse", &S::depthInvert},
    {"depth-range", "scene", "m", 0, 1e9, "depth where the stored value is 0 and where it is the largest; 0,0: scale and offset hold", &S::depthRange},
    {"depth-baseline", "scene", "m", 0, 1e6, "of the stereo pair whose disparity is stored", &S::depthBaseline_m},
    {"depth-channel", "scene", "", 0, 0, "channel that holds the depth; empty: Z, or the one whose name ends in .Z", &S::depthChannel},
    {"depth-packing", "scene", "", 0, 0, "depth in channels of 8 bits: rg or gr 16 bits, rgb or bgr 24, the highest first; hue as RealSense cameras colour it", &S::depthPacking, "none|rg|gr|rgb|bgr|hue"},
    {"depth-first-frame", "scene", "", -1e15, 1e15, "number of a depth movie's first frame; auto: 0", &S::depthFirstFrame},
    {"depth-no-value", "scene", "", -huge, huge, "stored depth that means 'not measured'", &S::depthNoValue},
    {"ground", "scene", "", 0, 0, "height[,pitch]: a ground plane instead of depth images; camera height m, pitch down deg", &S::ground},
    {"fog", "scene", "1/m", 0, 1e3, "extinction of the fog; auto: of the drops that are not drawn", &S::fog_1_m, nullptr,
     "transmittance is off by up to 0.002 from the optical depth itself, 0.0001 RMS (virga bench curves --only fog-table)"},
    {"fog-color", "scene", "", 0, 1e6, "linear r,g,b of the fog; auto: the light that drops return", &S::fogColor},
    {"fog-distance", "scene", "m", 0, 1e6, "how far the scene is taken to be for the fog without depth; with --ground, how far at most", &S::fogDistance_m},
    {"blur", "scene", "px", 0, 50, "blur by the rain in front, sigma at infinity", &S::blur_px, nullptr,
     "none, as it is off; at 2 px RMSE 0.0004 to 0.0034 of the plate's mean on three clips, 0.05 at the edges of the sample's depth, against one sum over both directions (virga bench curves --only blur)"},
    {"blur-distance", "scene", "m", 0.01, 1e6, "distance at which the blur has reached 63 %", &S::blurDistance_m},
    {"splashes", "scene", "x", 0, 100, "multiplies the number of splashes; needs depth or a ground", &S::splashes},
    {"splash-size", "scene", "x", 0.01, 100, "multiplies the size of splashes", &S::splashSize},
    {"darken", "grade", "", 0, 1, "how much light the rainy day takes away", &S::darken},
    {"desaturate", "grade", "", 0, 1, "how much colour it takes away", &S::desaturate},
    {"grade-from", "grade", "", 0, 0, "still whose colours the plate takes on", &S::gradeFrom},
    {"grade-amount", "grade", "", 0, 1, "how much of that", &S::gradeAmount},
    {"ocio", "file", "", 0, 0, "OpenColorIO configuration (a .ocio file); empty: what $OCIO names, else the built-in one", &S::ocio},
    {"colorspace", "file", "", 0, 0, "colour space of the plate; empty: what the file says (docs/colour.md)", &S::colorspace},
    {"output-colorspace", "file", "", 0, 0, "colour space of the output; empty: the plate's", &S::outputColorspace},
    {"float", "file", "", 0, 0, "write EXR as 32-bit float; else as the plate is, half if it is no EXR", &S::floatOutput, nullptr,
     "half layers put over one another are off by 0.03 % of the plate's mean RMS, 0.2 % at most, FLIP 0.0005; float ones by nothing (virga bench curves --only layers)"},
    {"codec", "file", "", 0, 0, "FFmpeg encoder for a movie; empty: fits container and plate", &S::codec},
    {"quality", "file", "", 0, 100, "its CRF or quantiser", &S::quality},
    {"pixel-format", "file", "", 0, 0, "pixel format of a movie, by FFmpeg's name (yuv422p10le); empty: the plate's, or the codec's nearest", &S::pixelFormat},
    {"profile", "file", "", 0, 0, "profile of the codec (4444, main10, dnxhr_hqx); empty: the plate's, or what the pixels need", &S::profile},
    {"preset", "file", "", 0, 0, "preset of the encoder (libx264, libx265: slow; libsvtav1: 8); empty: medium", &S::preset},
    {"codec-options", "file", "", 0, 0, "options of the encoder, name=value,... (qp=0,bf=2)", &S::codecOptions},
    {"container", "file", "", 0, 0, "container of a movie (mov, matroska, nut, y4m); empty: by the output's name; needed for -o -", &S::container},
    {"reencode", "file", "", 0, 0, "encode the pictures anew even if nothing happens to them; else they are copied as they are", &S::reencode},
    {"layer", "file", "", 0, 0, "layer of an EXR that is the plate: diffuse for diffuse.R, .G and .B; empty: the channels without one", &S::layer},
    {"view", "file", "", 0, 0, "view of a stereo EXR that is the plate: right; empty: the default one. The others come along into an EXR", &S::view},
    {"stream", "file", "", 0, 1000, "which of a movie's video streams, counted from 0; auto: the default one ('virga info PLATE' lists them)", &S::stream},
    {"deinterlace", "file", "", 0, 0, "make frames of interlaced pictures: the first field's lines stay, the others are made anew (bwdif)", &S::deinterlace},
    {"on-error", "file", "", 0, 0, "what to do with a frame that cannot be read", &S::onError, "stop|skip|hold"},
};
// clang-format on

template <class... Fs>
struct Overloaded : Fs... {
    using Fs::operator()...;
};
template <class... Fs>
Overloaded(Fs...) -> Overloaded<Fs...>;

/// Short if that loses nothing: 1e+06, but 4294967295.
std::string shortNumber(double value)
{
    const std::string text = fmt::format("{:g}", value);
    return std::stod(text) == value ? text : fmt::format("{}", value);
}

std::string allowed(const Parameter& p) { return rangeText(p) + (*p.unit ? std::string(" ") + p.unit : ""); }

[[noreturn]] void refuse(const Parameter& p, const std::string& text, const std::string& wanted)
{
    throw Error(ErrorCode::InvalidArgument, "--{} '{}': must be {}", p.name, text, wanted);
}

double checked(const Parameter& p, double value, const std::string& text)
{
    if (!(value >= p.least && value <= p.most)) refuse(p, text, allowed(p));
    return value;
}

double numberFrom(const Parameter& p, std::string_view word, const std::string& text)
{
    double value = 0;
    const char* first = word.data();
    const char* last = first + word.size();
    if (first != last && *first == '+') ++first;
    const auto [end, error] = std::from_chars(first, last, value);
    if (error != std::errc() || end != last) refuse(p, text, "a number, " + allowed(p));
    return checked(p, value, text);
}

/// "1,2,3" -> exactly N numbers.
template <std::size_t N>
std::array<double, N> numbersFrom(const Parameter& p, const std::string& text)
{
    std::array<double, N> numbers{};
    std::string_view rest = text;
    for (std::size_t i = 0; i < N; ++i) {
        const std::size_t comma = rest.find(',');
        if ((comma == std::string_view::npos) != (i + 1 == N))
            refuse(p, text, fmt::format("{} numbers separated by commas, each {}", N, allowed(p)));
        numbers[i] = numberFrom(p, rest.substr(0, comma), text);
        rest.remove_prefix(comma == std::string_view::npos ? rest.size() : comma + 1);
    }
    return numbers;
}

bool isChoice(const Parameter& p, std::string_view word)
{
    std::string_view rest = p.choices;
    while (true) {
        const std::size_t bar = rest.find('|');
        if (rest.substr(0, bar) == word) return true;
        if (bar == std::string_view::npos) return false;
        rest.remove_prefix(bar + 1);
    }
}

/// The shortest text that reads back to the same double.
std::string numberText(double value) { return fmt::format("{}", value); }

template <std::size_t N>
std::string numbersText(const std::array<double, N>& values)
{
    std::string text;
    for (const double v : values) text += (text.empty() ? "" : ",") + numberText(v);
    return text;
}

}  // namespace

std::span<const Parameter> parameters() { return table; }

const Parameter& findParameter(std::string_view name)
{
    std::vector<std::string> known;
    for (const Parameter& p : table) {
        if (name == p.name) return p;
        known.emplace_back(p.name);
    }
    const std::string nearest = nearestWord(name, known);
    throw Error(ErrorCode::InvalidArgument, "no setting is called '{}'{}", name,
                nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest));
}

void setFromText(Settings& settings, const Parameter& p, const std::string& text)
{
    std::visit(Overloaded{
                   [&](double S::*m) { settings.*m = numberFrom(p, text, text); },
                   [&](AutoNumber S::*m) {
                       if (text == "auto")
                           settings.*m = std::nullopt;
                       else
                           settings.*m = numberFrom(p, text, text);
                   },
                   [&](std::int64_t S::*m) {
                       const double value = numberFrom(p, text, text);
                       if (value != std::round(value)) refuse(p, text, "a whole number, " + allowed(p));
                       settings.*m = std::int64_t(value);
                   },
                   [&](bool S::*m) {
                       if (text != "true" && text != "false") refuse(p, text, "true or false");
                       settings.*m = text == "true";
                   },
                   [&](std::string S::*m) {
                       if (p.choices != nullptr && !isChoice(p, text)) refuse(p, text, rangeText(p));
                       settings.*m = text;
                   },
                   [&](std::array<double, 2> S::*m) { settings.*m = numbersFrom<2>(p, text); },
                   [&](AutoColor S::*m) {
                       if (text == "auto")
                           settings.*m = std::nullopt;
                       else
                           settings.*m = numbersFrom<3>(p, text);
                   },
               },
               p.member);
}

std::string toText(const Settings& settings, const Parameter& p)
{
    return std::visit(
        Overloaded{
            [&](double S::*m) { return numberText(settings.*m); },
            [&](AutoNumber S::*m) { return settings.*m ? numberText(*(settings.*m)) : std::string("auto"); },
            [&](std::int64_t S::*m) { return std::to_string(settings.*m); },
            [&](bool S::*m) { return std::string(settings.*m ? "true" : "false"); },
            [&](std::string S::*m) { return settings.*m; },
            [&](std::array<double, 2> S::*m) { return numbersText(settings.*m); },
            [&](AutoColor S::*m) { return settings.*m ? numbersText(*(settings.*m)) : std::string("auto"); },
        },
        p.member);
}

void setFromJson(Settings& settings, const Parameter& p, const nlohmann::json& value)
{
    if (value.is_string())
        setFromText(settings, p, value.get<std::string>());
    else if (value.is_number())
        setFromText(settings, p, numberText(value.get<double>()));
    else if (value.is_boolean())
        setFromText(settings, p, value.get<bool>() ? "true" : "false");
    else if (value.is_array()) {
        std::string text;
        for (const nlohmann::json& item : value) {
            if (!item.is_number()) refuse(p, shortened(value.dump()), "a list of numbers");
            text += (text.empty() ? "" : ",") + numberText(item.get<double>());
        }
        setFromText(settings, p, text);
    } else {
        refuse(p, shortened(value.dump()), "a number, a text, a list of numbers, true or false");
    }
}

nlohmann::json toJson(const Settings& settings, const Parameter& p)
{
    return std::visit(Overloaded{
                          [&](double S::*m) -> nlohmann::json { return settings.*m; },
                          [&](AutoNumber S::*m) -> nlohmann::json {
                              if (settings.*m) return *(settings.*m);
                              return "auto";
                          },
                          [&](std::int64_t S::*m) -> nlohmann::json { return settings.*m; },
                          [&](bool S::*m) -> nlohmann::json { return settings.*m; },
                          [&](std::string S::*m) -> nlohmann::json { return settings.*m; },
                          [&](std::array<double, 2> S::*m) -> nlohmann::json { return settings.*m; },
                          [&](AutoColor S::*m) -> nlohmann::json {
                              if (settings.*m) return *(settings.*m);
                              return "auto";
                          },
                      },
                      p.member);
}

std::string rangeText(const Parameter& p)
{
    if (p.choices == nullptr) {
        const bool isNumber = !p.isSwitch() && !std::holds_alternative<std::string S::*>(p.member);
        return isNumber ? fmt::format("{} to {}", shortNumber(p.least), shortNumber(p.most)) : "";
    }
    std::string words = p.choices;
    if (const std::size_t last = words.rfind('|'); last != std::string::npos) words.replace(last, 1, " or ");
    for (std::size_t at = 0; (at = words.find('|', at)) != std::string::npos;) words.replace(at, 1, ", ");
    return words;
}

std::string parametersPage()
{
    std::string page =
        "# Parameters\n\n"
        "Generated from the parameter table by `virga info --parameters`; a test holds it current. Every row is a flag "
        "of `virga rain`, a key of its settings file, and a setting of the library. Where a default trades error for time "
        "the row says what it is off by, on the sample unless it says otherwise, and which command measures that "
        "(docs/benchmarks.md).\n\n";
    const Settings defaults;
    std::string_view group;
    for (const Parameter& p : table) {
        if (group != p.group) {
            group = p.group;
            page += fmt::format("## {}\n\n| flag | default | unit | range | what it does |\n|---|---|---|---|---|\n",
                                group);
        }
        const bool isText = std::holds_alternative<std::string S::*>(p.member);
        std::string range = p.isSwitch() ? ""
                            : isText     ? ""
                                         : fmt::format("{} … {}", shortNumber(p.least), shortNumber(p.most));
        if (p.choices != nullptr) {
            range = p.choices;
            for (std::size_t at = 0; (at = range.find('|', at)) != std::string::npos; at += 3)
                range.replace(at, 1, " / ");
        }
        const std::string value = toText(defaults, p);
        const std::string error = p.error == nullptr ? "" : fmt::format(". *Error:* {}", p.error);
        page += fmt::format("| `--{}` | {} | {} | {} | {}{} |\n", p.name, value.empty() ? "" : "`" + value + "`", p.unit,
                            range, p.help, error);
        const bool lastOfGroup = &p == std::end(table) - 1 || std::string_view((&p)[1].group) != group;
        if (lastOfGroup) page += "\n";
    }
    page.pop_back();
    return page;
}

}  // namespace virga::shot
