#include "stress/Combination.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/trigonometric.hpp>
#include <limits>

#include "io/Plate.h"
#include "shot/RainModel.h"

namespace virga::stress {

namespace {

using shot::Parameter;
using shot::Settings;
using Random = std::mt19937_64;

constexpr float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();

template <class... Fs>
struct Overloaded : Fs... {
    using Fs::operator()...;
};
template <class... Fs>
Overloaded(Fs...) -> Overloaded<Fs...>;

double unit(Random& random) { return std::uniform_real_distribution<double>(0, 1)(random); }
bool chance(Random& random, double share) { return unit(random) < share; }

template <class T>
const T& pick(Random& random, const std::vector<T>& list)
{
    return list[std::size_t(random() % list.size())];
}

/// An end of the range, or a number within it of any magnitude.
double numberFor(const Parameter& p, Random& random)
{
    if (chance(random, 0.15)) return p.least;
    if (chance(random, 0.15)) return p.most;
    if (p.least <= 0 && p.most >= 0 && chance(random, 0.1)) return 0;
    if (chance(random, 0.4)) return p.least + (p.most - p.least) * unit(random);
    const double largest = chance(random, 0.5) && p.least < 0 ? p.least : p.most;
    const double smallest = std::max(p.least > 0 ? p.least : 0, 1e-12 * std::abs(largest));
    const double value =
        std::copysign(std::exp(std::log(smallest) + unit(random) * std::log(std::abs(largest) / smallest)), largest);
    return std::clamp(value, p.least, p.most);
}

std::string choiceFor(const Parameter& p, Random& random)
{
    std::vector<std::string> words(1);
    for (const char* c = p.choices; *c != 0; ++c)
        if (*c == '|')
            words.emplace_back();
        else
            words.back() += *c;
    return pick(random, words);
}

void choose(Settings& settings, const Parameter& p, Random& random, const Files& files)
{
    const std::string name = p.name;
    std::visit(Overloaded{
                   [&](double Settings::*m) { settings.*m = numberFor(p, random); },
                   [&](shot::AutoNumber Settings::*m) {
                       settings.*m = numberFor(p, random);
                       if (name == "env-order") settings.*m = std::round(*(settings.*m));
                   },
                   [&](std::int64_t Settings::*m) { settings.*m = std::int64_t(std::round(numberFor(p, random))); },
                   [&](bool Settings::*m) { settings.*m = chance(random, 0.5); },
                   [&](std::string Settings::*m) {
                       if (p.choices != nullptr)
                           settings.*m = choiceFor(p, random);
                       else if (!files.of(name).empty())
                           settings.*m = pick(random, files.of(name));
                   },
                   [&](std::array<double, 2> Settings::*m) {
                       for (double& number : settings.*m) number = numberFor(p, random);
                   },
                   [&](shot::AutoColor Settings::*m) {
                       (settings.*m).emplace();
                       for (double& number : *(settings.*m)) number = numberFor(p, random);
                   },
               },
               p.member);
}

std::string flags(const Settings& settings)
{
    std::string text;
    const Settings standard;
    for (const Parameter& p : shot::parameters())
        if (const std::string value = shot::toText(settings, p); value != shot::toText(standard, p))
            text += fmt::format(" --{} {}", p.name, value);
    return text;
}

/// Light of any magnitude, with values among it that no light has.
ImageF plateFor(Random& random, int width, int height, bool isOpaque, Ceiling& ceiling)
{
    const double scale = std::pow(10.0, std::uniform_int_distribution<int>(-6, 4)(random));
    const bool isBroken = chance(random, 0.3), isFlat = chance(random, 0.2);
    ImageF plate(width, height, 4);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double alpha = isOpaque ? 1 : pick(random, std::vector<double>{0, 0.5, 1, unit(random)});
            plate.at(x, y, 3) = float(alpha);
            for (int c = 0; c < 3; ++c) {
                float value = float(scale * alpha * (isFlat ? 0.5 : unit(random)));
                if (isBroken && chance(random, 0.05)) value = pick(random, std::vector<float>{nan, inf, -inf, -1, 0});
                // A pixel that shines and covers nothing has any light.
                if (alpha == 0 && value > 0) ceiling.isKnown = false;
                plate.at(x, y, c) = value;
                // Infinite light is repaired to the most that half holds; a pixel that is not opaque has more than it
                // shows.
                const double light = value == inf ? 65504.0 : std::isfinite(value) ? double(value) : 0.0;
                ceiling.light = std::max(ceiling.light, light / (alpha > 0 ? alpha : 1));
                ceiling.least = std::min(ceiling.least, std::isfinite(value) ? double(value) : 0.0);
            }
        }
    return plate;
}

constexpr double mostStrokes = 3000;  // what a test has time for

/// About as many strokes as a frame of the shot will show without --strokes; 0 if it will be refused.
double strokesOf(Settings settings, const shot::Shot& shot)
{
    settings.strokes.reset();
    particles::Exposure exposure;
    try {
        exposure.duration_s = shot::exposureOf(settings, shot.fps);
        exposure.projection =
            camera::projectionFromHorizontalFov(shot.width, shot.height, glm::radians(settings.fov_deg.value_or(60)));
        const shot::RainModel rain(settings, exposure);
        return rain.field().expectedStrokes(exposure.projection, exposure.duration_s, rain.visibility(exposure));
    } catch (const Error& error) {
        // Too many of them is a reason to ask for fewer.
        return std::string_view(error.what()).find("at most") != std::string_view::npos ? 1e9 : 0;
    }
}

ImageF filled(int width, int height, int channels, float value) { return ImageF(width, height, channels, value); }

}  // namespace

Files::Files()
{
    const std::vector<std::string> rgb = {"R", "G", "B"}, z = {"Z"};
    makeImage("env", "white.exr", filled(32, 16, 3, 1), rgb);
    makeImage("env", "black.exr", filled(32, 16, 3, 0), rgb);
    makeImage("env", "huge.exr", filled(32, 16, 3, 1e9f), rgb);
    makeImage("env", "pixel.exr", filled(1, 1, 3, 3), rgb);
    ImageF sun = filled(64, 32, 3, 0.1f), broken = filled(16, 8, 3, 0.5f);
    for (int c = 0; c < 3; ++c) sun.at(9, 7, c) = 1e9f;
    broken.at(3, 3, 0) = nan, broken.at(4, 3, 1) = -5, broken.at(5, 5, 2) = inf;
    makeImage("env", "sun.exr", sun, rgb);
    makeImage("env", "broken.exr", broken, rgb);

    ImageF checks = filled(8, 6, 1, 10);
    for (int y = 0; y < 6; ++y)
        for (int x = 0; x < 8; ++x) {
            const float odd[] = {nan, 0, -1, inf, 10, 1e-6f, 1e9f};
            checks.at(x, y) = odd[(x + 3 * y) % 7];
        }
    makeImage("depth", "checks.exr", checks, z);
    makeImage("depth", "near.exr", filled(8, 6, 1, 1e-6f), z);
    makeImage("depth", "sky.exr", filled(8, 6, 1, inf), z);
    ImageF ramp(33, 17, 1);
    for (std::size_t i = 0; i < ramp.size(); ++i) ramp.data()[i] = float(i) * 0.1f;
    makeImage("depth", "ramp.exr", ramp, z);

    ImageF still = filled(8, 8, 3, 0.2f);
    still.at(1, 1, 0) = 4;
    makeImage("grade-from", "still.exr", still, rgb);
    ImageF tiles = filled(32, 64, 1, 0.01f);
    for (int y = 8; y < 56; ++y) tiles.at(7, y) = tiles.at(24, y) = 1;
    makeImage("mattes", "atlas.exr", tiles, {"Y"});

    makeText("ground", "", "1.7");
    makeText("ground", "", "10000,-89.9");
    makeText("ground", "", "1e-6,89.9");
    makeText("lights", "lamp.toml", "[[light]]\nposition = [0.5, 1, -3]\nradiance = [9, 6, 3]\nradius_m = 0.16\n");
    makeText("lights", "in_camera.toml",
             "[[light]]\nposition = [0, 0, 0]\nradiance = [9, 6, 3]\nradius_m = 1\n"
             "[[light]]\nposition = [1000000, 1000000, -1000000]\nintensity = [1000000000, 0, 0]\n");
    makeText("camera", "still.chan", "1 0 2 0 -5 30 0 40\n");
    makeText("camera", "walk.chan", "0 0 1.7 0 0 0 0 40\n100 30 1.7 -20 -5 90 10 60\n");
    makeText("camera", "bullet.chan", "0 0 1.7 0 0 0 0 40\n1 400 1.7 -300 0 170 0 40\n");
    makeText("camera", "far.chan", "0 1e7 1.7 -1e7 0 0 0 40\n100 10000030 1.7 -1e7 -5 90 10 60\n");
    makeText("camera", "zoom.chan", "0 0 1.7 0 0 0 0 0.01\n100 0 1.7 0 0 0 0 179\n");
}

void Files::makeImage(const std::string& parameter, const std::string& name, const ImageF& pixels,
                      const std::vector<std::string>& channels)
{
    io::writeExr(folder_ / name, pixels, channels, false);
    files_[parameter].push_back(folder_ / name);
    double& light = light_[folder_ / name];
    for (std::size_t i = 0; i < pixels.size(); ++i)
        if (std::isfinite(pixels.data()[i])) light = std::max(light, double(pixels.data()[i]));
}

void Files::makeText(const std::string& parameter, const std::string& name, const std::string& text, double light)
{
    files_[parameter].push_back(name.empty() ? text : folder_.write(name, text));
    light_[files_[parameter].back()] = light;
}

const std::vector<std::string>& Files::of(std::string_view parameter) const
{
    static const std::vector<std::string> none;
    const auto found = files_.find(parameter);
    return found == files_.end() ? none : found->second;
}

double Files::lightOf(const std::string& path) const
{
    const auto found = light_.find(path);
    return found == light_.end() ? 0 : found->second;
}

Combination combination(std::uint32_t seed, std::uint32_t number, const Files& files)
{
    std::seed_seq both{seed, number};
    Random random(both);
    Combination made;
    Settings& s = made.settings;
    const double share = pick(random, std::vector<double>{0.05, 0.2, 0.5});
    for (const Parameter& p : shot::parameters())
        if (std::string_view(p.group) != "file" && chance(random, share)) choose(s, p, random, files);
    if (s.far_m <= s.near_m && chance(random, 0.95)) std::swap(s.far_m, s.near_m);
    constexpr std::pair<int, int> sizes[] = {{1, 1}, {1, 9}, {9, 1}, {16, 9}, {33, 17}, {64, 36}, {257, 2}};
    const auto [width, height] = sizes[random() % std::size(sizes)];
    made.shot.width = width;
    made.shot.height = height;
    made.shot.fps = s.fps.value_or(pick(random, std::vector<double>{24, 23.976, 1e-3, 1e5, 120}));
    made.frame = pick(random, std::vector<FrameNumber>{0, 1, 100, -7, 1'000'000'000, -1'000'000'000, 123'456'789});
    made.shot.firstFrame = chance(random, 0.5) ? made.frame : 0;
    if (const double strokes = strokesOf(s, made.shot); !(strokes < mostStrokes))
        s.strokes = std::round(std::pow(mostStrokes, unit(random)));
    else if (strokes < 1)
        s.strokes.reset();
    made.layers = chance(random, 0.5);
    made.isOpaque = chance(random, 0.7);
    made.ceiling.light = 0;
    made.plate = plateFor(random, width, height, made.isOpaque, made.ceiling);

    // The plate's own light may be taken for a lamp that is clipped, the sky and the fog may be given.
    double& light = made.ceiling.light;
    light = std::max(light, s.sky.value_or(0));
    if (!s.env.empty()) light = std::max(light, files.lightOf(s.env));
    light *= std::max(1.0, s.envGain);
    if (s.fogColor) light = std::max(light, *std::max_element(s.fogColor->begin(), s.fogColor->end()));
    made.ceiling.isKnown = made.ceiling.isKnown && s.lights.empty() && s.gradeFrom.empty() && !s.paper &&
                           s.backgroundBoost == 0 && !s.lightRadiance;
    made.description = fmt::format("seed {}, number {}: {}x{}, {} fps, frame {} of a shot from {}{}{}:{}", seed, number,
                                   width, height, made.shot.fps, made.frame, made.shot.firstFrame,
                                   made.layers ? ", layers" : "", made.isOpaque ? "" : ", transparent", flags(s));
    return made;
}

std::vector<std::string> valuesBeyond(const Parameter& p)
{
    const std::vector<std::string> words = {"nan", "inf", "-inf", "1e400", "", "rain", "0x10", "1,", "--1"};
    std::vector<std::string> beyond;
    if (p.isSwitch()) return {"1", "yes", "True", "", "nan"};
    if (p.choices != nullptr) return {"", "rain", "|", p.choices};
    if (std::holds_alternative<std::string Settings::*>(p.member)) return {};
    const std::size_t numbers = std::holds_alternative<std::array<double, 2> Settings::*>(p.member) ? 2
                                : std::holds_alternative<shot::AutoColor Settings::*>(p.member)     ? 3
                                                                                                    : 1;
    const auto list = [&](const std::string& word) {
        std::string text = word;
        for (std::size_t i = 1; i < numbers; ++i) text += fmt::format(",{}", p.least);
        return text;
    };
    for (const double value : {std::nextafter(p.most, 1e300), std::nextafter(p.least, -1e300), 2 * p.most + 1,
                               p.least - 1 - std::abs(p.least), 1e300, -1e300})
        beyond.push_back(list(fmt::format("{}", value)));
    for (const std::string& word : words) beyond.push_back(list(word));
    beyond.push_back(list("1") + ",1");
    if (numbers > 1) beyond.push_back("1");
    return beyond;
}

}  // namespace virga::stress
