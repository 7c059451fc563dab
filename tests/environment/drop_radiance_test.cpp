#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/Error.h"
#include "core/Parallel.h"
#include "environment/DropRadiance.h"
#include "sh/Panorama.h"

namespace virga::environment {
namespace {

constexpr double pi = std::numbers::pi;

template <class F>
Panorama paint(int width, int height, F&& radiance)
{
    Panorama result{ImageF(width, height, 3)};
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const glm::dvec3 c = radiance(sh::panoramaDirection(x + 0.5, y + 0.5, width, height));
            for (int k = 0; k < 3; ++k) result.pixels.at(x, y, k) = float(c[k]);
        }
    }
    return result;
}

std::vector<glm::dvec3> directions(int count)
{
    std::vector<glm::dvec3> result;
    for (int i = 0; i < count; ++i) {
        const double y = 1.0 - 2.0 * (i + 0.5) / count;
        const double azimuth = i * pi * (3.0 - std::sqrt(5.0));
        const double s = std::sqrt(1.0 - y * y);
        result.emplace_back(s * std::sin(azimuth), y, -s * std::cos(azimuth));
    }
    return result;
}

TEST(DropRadiance, AWhiteWorldIsWhiteAtEveryOrder)
{
    for (const int order : {DropRadianceOptions::autoOrder, 0, 1, 3, 8, 12, 31, 64, 128}) {
        const DropRadianceBaker baker({.order = order, .lights = false});
        for (const auto& [width, height] :
             {std::array{1, 1}, std::array{2, 1}, std::array{64, 32}, std::array{300, 150}}) {
            const DropRadiance r = baker.bake(paint(width, height, [](auto) { return glm::dvec3(1.0, 1.0, 1.0); }));
            for (const float value : r.radiance.values()) ASSERT_NEAR(value, 1.0f, 1e-6f) << order;
            for (const float value : r.background.values()) ASSERT_NEAR(value, 1.0f, 1e-6f) << order;
        }
    }
}

TEST(DropRadiance, AWhiteWorldHasNoLights)
{
    const DropRadianceBaker baker;
    const DropRadiance r = baker.bake(paint(128, 64, [](auto) { return glm::dvec3(0.3); }));
    EXPECT_TRUE(r.lights.empty());
    EXPECT_EQ(r.order, 0);
    for (const float value : r.radiance.values()) ASSERT_NEAR(value, 0.3f, 1e-6f);
}

TEST(DropRadiance, PaperModeKeepsThePapersArithmetic)
{
    const DropRadianceBaker baker({.paper = true});
    const DropRadiance r = baker.bake(paint(64, 32, [](auto) { return glm::dvec3(1.0); }));
    EXPECT_TRUE(r.paper);
    EXPECT_EQ(r.order, 3);
    // Nine terms hold 99.983 % of the power.
    for (const float value : r.radiance.values()) ASSERT_NEAR(value, 0.9998284f, 1e-6f);
}

// Environments of the reference, whose z is up: (x, y, z) there is (x, z, -y) here, turned about the vertical so that
// the sun at azimuth 30 degrees meets the centre of a pixel of a map with 1028 x 514.
constexpr int sunMapWidth = 1028, sunMapHeight = 514;

struct Reference {
    nlohmann::json table = nlohmann::json::parse(std::ifstream(VIRGA_TEST_DATA "/drop_radiance.json"));
    double turn = 0.0;
    glm::dvec3 sun;

    Reference()
    {
        const double elevation = pi / 4, azimuth = pi / 6;
        const glm::dvec3 theirs(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                                std::sin(elevation));
        const double x = sh::panoramaPlace(toOurs(theirs), sunMapWidth, sunMapHeight).x;
        turn = (std::floor(x) + 0.5 - x) / sunMapWidth * 2 * pi;
        sun = toOurs(theirs);
    }
    glm::dvec3 toOurs(const glm::dvec3& d) const
    {
        const glm::dvec3 v(d.x, d.z, -d.y);
        return {std::cos(turn) * v.x - std::sin(turn) * v.z, v.y, std::sin(turn) * v.x + std::cos(turn) * v.z};
    }
    std::size_t views() const { return table["view"].size(); }
    glm::dvec3 view(std::size_t i) const
    {
        const auto& v = table["view"][i];
        return toOurs({v[0].get<double>(), v[1].get<double>(), v[2].get<double>()});
    }
    double value(const char* environment, const char* what, std::size_t i) const
    {
        return table[environment][what][i].get<double>();
    }
    Panorama cosine() const
    {
        const glm::dvec3 a = glm::normalize(toOurs({0.3, -0.5, 0.8}));
        return paint(1024, 512, [a](const glm::dvec3& d) { return glm::dvec3(std::max(0.0, glm::dot(a, d))); });
    }
    Panorama sunAndSky() const
    {
        Panorama p = paint(sunMapWidth, sunMapHeight,
                           [](const glm::dvec3& d) { return glm::dvec3(d.y >= 0.0 ? 1.0 - 0.6 * d.y : 0.2); });
        const glm::dvec2 place = sh::panoramaPlace(sun, sunMapWidth, sunMapHeight);
        const int y = int(place.y);
        const double pixel =
            2 * pi / sunMapWidth * (std::cos(pi * y / sunMapHeight) - std::cos(pi * (y + 1) / sunMapHeight));
        const double disc = 2 * pi * (1 - std::cos(0.27 * pi / 180));
        for (int c = 0; c < 3; ++c) p.pixels.at(int(place.x), y, c) += float(1e5 * disc / pixel);
        return p;
    }
};

/// Root mean square difference over the reference's views, in the green channel (index 1.333).
template <class Ours>
double rms(const Reference& reference, const char* environment, const char* what, Ours&& ours)
{
    double sum = 0.0;
    for (std::size_t i = 0; i < reference.views(); ++i) {
        const double difference = ours(reference.view(i)).g - reference.value(environment, what, i);
        sum += difference * difference;
    }
    return std::sqrt(sum / double(reference.views()));
}

TEST(DropRadiance, PaperModeAgreesWithTheReference)
{
    const Reference reference;
    const Panorama cosine = reference.cosine(), sunAndSky = reference.sunAndSky();
    for (const auto& [order, what] : {std::pair{3, "paper_order_3"}, {8, "paper_order_8"}, {16, "paper_order_16"}}) {
        const DropRadianceBaker baker({.order = order, .paper = true});
        const DropRadiance c = baker.bake(cosine);
        EXPECT_LT(rms(reference, "cosine", what, [&](auto v) { return baker.exactly(c, v); }), 2e-6) << order;
        // One pixel stands for the sun, and the horizon lies between two rows: 1 % of the brightest view.
        const DropRadiance s = baker.bake(sunAndSky);
        EXPECT_LT(rms(reference, "sunsky", what, [&](auto v) { return baker.exactly(s, v); }), 3e-3) << order;
    }
}

// The reference stops after nine encounters, which leaves 2.1e-4 of the light; ours sums them all.
TEST(DropRadiance, TheDefaultAgreesWithTheExactIntegral)
{
    const Reference reference;
    const DropRadianceBaker baker;
    const DropRadiance cosine = baker.bake(reference.cosine());
    EXPECT_LT(rms(reference, "cosine", "polar", [&](auto v) { return baker.exactly(cosine, v); }), 0.002);
    EXPECT_LT(rms(reference, "cosine", "polar", [&](auto v) { return sampleMap(cosine.radiance, v); }), 0.002);

    const DropRadiance sunny = baker.bake(reference.sunAndSky());
    ASSERT_EQ(sunny.lights.size(), 1u);
    EXPECT_LT(glm::length(sunny.lights[0].direction - reference.sun), 1e-3);
    // 1.77 rms in all; 16 coefficients with the sun inside are off by 0.54, 66,000 by 0.016.
    EXPECT_LT(rms(reference, "sunsky", "polar", [&](auto v) { return baker.exactly(sunny, v); }), 0.012);
    EXPECT_LT(rms(reference, "sunsky", "polar", [&](auto v) { return sampleMap(sunny.radiance, v); }), 0.012);

    // Taken out of the harmonics, the sun leaves a sky that order 3 does about as well as l = 256 did with the sun
    // inside.
    const DropRadianceBaker low({.order = 3});
    const DropRadiance lowSunny = low.bake(reference.sunAndSky());
    EXPECT_LT(rms(reference, "sunsky", "polar", [&](auto v) { return low.exactly(lowSunny, v); }), 0.02);
}

double meanOverSphere(const ImageF& map)
{
    double sum = 0.0;
    for (int y = 0; y < map.height(); ++y) {
        const double row = 0.5 * (std::cos(pi * y / map.height()) - std::cos(pi * (y + 1) / map.height()));
        for (int x = 0; x < map.width(); ++x) sum += row / map.width() * map.at(x, y, 1);
    }
    return sum;
}

/// A street at night or dusk in formulas: sky, ground, a wall, lamps.
Panorama street(double lamp)
{
    return paint(256, 128, [lamp](const glm::dvec3& d) {
        glm::dvec3 c = d.y > 0.1 ? glm::dvec3(0.5, 0.6, 0.8) : glm::dvec3(0.12, 0.1, 0.08);
        if (d.x > 0.6 && std::abs(d.y) < 0.5) c = glm::dvec3(0.3, 0.2, 0.15);
        if (glm::dot(d, glm::normalize(glm::dvec3(0.5, 0.4, -1.0))) > std::cos(0.05))
            c += lamp * glm::dvec3(1.0, 0.7, 0.3);
        if (glm::dot(d, glm::normalize(glm::dvec3(-1.5, 0.3, -1.0))) > std::cos(0.03)) c += 0.5 * lamp;
        return c;
    });
}

TEST(DropRadiance, NoLightIsLostOrMade)
{
    const DropRadianceBaker baker;
    for (const double lamp : {0.0, 3.0, 30.0, 1000.0}) {
        const Panorama world = street(lamp);
        EXPECT_NEAR(meanOverSphere(baker.bake(world).radiance) / meanOverSphere(world.pixels), 1.0, 3e-3) << lamp;
    }
    const DropRadianceBaker smooth({.lights = false});
    const Panorama dim = street(0.0);
    EXPECT_NEAR(meanOverSphere(smooth.bake(dim).background) / meanOverSphere(dim.pixels), 1.0, 3e-3);
}

TEST(DropRadiance, AutoKeepsItsPromise)
{
    const Panorama world = street(2.0);
    const DropRadianceBaker best({.order = 100, .lights = false});
    const DropRadiance exact = best.bake(world);
    for (const double tolerance : {0.05, 0.01, 0.002}) {
        const DropRadianceBaker baker({.tolerance = tolerance, .lights = false});
        const DropRadiance r = baker.bake(world);
        EXPECT_LE(r.remainder, tolerance);
        double square = 0.0, mean = 0.0;
        const auto views = directions(500);
        for (const auto& v : views) {
            const glm::dvec3 e = baker.exactly(r, v) - best.exactly(exact, v);
            square += glm::dot(e, e) / double(views.size());
            const glm::dvec3 m = best.exactly(exact, v);
            mean += glm::dot(m, m) / double(views.size());
        }
        EXPECT_LT(std::sqrt(square / mean), 1.1 * tolerance);
        // One order lower would not do.
        const DropRadianceBaker lower({.order = r.order - 1, .lights = false});
        EXPECT_GT(lower.bake(world).remainder, tolerance);
    }
}

// Fog shows what is behind it, however coarsely drops are lit.
TEST(DropRadiance, TheBackgroundNeedNotFollowTheOrder)
{
    constexpr int automatic = DropRadianceOptions::autoOrder;
    const Panorama world = street(2.0);
    const DropRadiance usual = DropRadianceBaker().bake(world);
    for (const int order : {0, 3, 12, 64, 128}) {
        const DropRadiance r = DropRadianceBaker({.order = order, .backgroundOrder = automatic}).bake(world);
        EXPECT_EQ(r.order, order);
        ASSERT_EQ(r.background.width(), usual.background.width()) << order;
        for (std::size_t i = 0; i < usual.background.size(); ++i)
            ASSERT_NEAR(r.background.data()[i], usual.background.data()[i], 1e-5f) << order;
        const DropRadiance same = DropRadianceBaker({.order = order}).bake(world);
        ASSERT_EQ(r.radiance.width(), same.radiance.width()) << order;
        for (std::size_t i = 0; i < same.radiance.size(); ++i)
            ASSERT_NEAR(r.radiance.data()[i], same.radiance.data()[i], 1e-5f) << order;
    }
    // And the other way round.
    const DropRadiance coarse = DropRadianceBaker({.backgroundOrder = 3}).bake(world);
    EXPECT_EQ(coarse.order, usual.order);
    EXPECT_EQ(coarse.background.width(), DropRadianceBaker({.order = 3}).bake(world).background.width());
    EXPECT_THROW(DropRadianceBaker({.backgroundOrder = 129}), Error);
}

TEST(DropRadiance, MapsAreFineEnough)
{
    for (const int order : {3, 12, 40}) {
        const DropRadianceBaker baker({.order = order, .lights = false});
        const DropRadiance r = baker.bake(street(5.0));
        double square = 0.0;
        const auto views = directions(1000);
        for (const auto& v : views) {
            const double e = sampleMap(r.radiance, v).g - baker.exactly(r, v).g;
            square += e * e / double(views.size());
        }
        EXPECT_LT(std::sqrt(square) / meanOverSphere(r.radiance), 2e-3) << order;
    }
}

// A light taken out and the same light left in the harmonics, where they can hold it, are one picture.
TEST(DropRadiance, ThePlaceOfTheSplitDoesNotShow)
{
    const auto moon = [](double radiance) {
        return paint(512, 256, [radiance](const glm::dvec3& d) {
            const double c = glm::dot(d, glm::normalize(glm::dvec3(0.5, 0.4, -1.0)));
            return glm::dvec3(0.5 + radiance * std::exp((c - 1.0) / 0.003));  // 4.4 degrees to 1/e
        });
    };
    const DropRadianceBaker split;
    const DropRadianceBaker whole({.order = 96, .lights = false});
    for (const double radiance : {5.0, 20.0, 100.0}) {
        const DropRadiance a = split.bake(moon(radiance)), b = whole.bake(moon(radiance));
        double square = 0.0, mean = 0.0;
        const auto views = directions(800);
        for (const auto& v : views) {
            const double e = split.exactly(a, v).g - whole.exactly(b, v).g;
            square += e * e / double(views.size());
            mean += whole.exactly(b, v).g / double(views.size());
        }
        EXPECT_LT(std::sqrt(square) / mean, 0.006) << radiance << ": " << a.lights.size() << " lights";
    }
}

TEST(DropRadiance, ALightThatGrowsDoesNotPop)
{
    const DropRadianceBaker baker({.order = 12});
    const glm::dvec3 ahead = glm::normalize(glm::dvec3(0.5, 0.4, -1.0));
    double before = 0.0, slope = 0.0;
    for (double lamp = 1.0; lamp < 12.0; lamp += 0.25) {
        const DropRadiance r = baker.bake(street(lamp));
        const double here = sampleMap(r.radiance, ahead).g;
        if (before > 0.0) {
            EXPECT_GT(here, before);
            if (slope > 0.0) {
                EXPECT_NEAR(here - before, slope, 0.01) << lamp;
            }
            slope = here - before;
        }
        before = here;
    }
}

TEST(DropRadiance, TheBackgroundDoesNotRing)
{
    const DropRadianceBaker baker({.order = 12});
    const DropRadiance r = baker.bake(street(1000.0));
    const auto [least, most] = std::minmax_element(r.background.values().begin(), r.background.values().end());
    EXPECT_GT(*least, 0.05f);  // the ground's blue is 0.08
    const float threshold = 8.0f;
    EXPECT_LT(*most, threshold * 0.8f);
}

TEST(DropRadiance, SurvivesExtremes)
{
    const DropRadianceBaker baker;
    Panorama black{ImageF(64, 32, 3)};
    const DropRadiance dark = baker.bake(black);
    for (const float value : dark.radiance.values()) ASSERT_EQ(value, 0.0f);
    Panorama spark{ImageF(512, 256, 3)};
    spark.pixels.at(160, 80, 0) = 1e9f;
    const DropRadiance r = baker.bake(spark);
    for (const float value : r.radiance.values()) ASSERT_TRUE(std::isfinite(value) && value >= 0.0f);
    // In the rainbow's ring the red of a drop of index 1.331 is tens of times what it is in Alexander's dark band.
    ASSERT_FALSE(r.lights.empty());
    const glm::dvec3 away = -r.lights[0].direction;
    const glm::dvec3 side = glm::normalize(glm::cross(away, glm::dvec3(0, 1, 0)));
    const auto at = [&](double degrees) {
        const double t = (180.0 - degrees) * pi / 180.0;
        return sampleMap(r.radiance, std::cos(t) * away + std::sin(t) * side).r;
    };
    EXPECT_GT(at(138.0), 20 * at(133.0));
}

TEST(DropRadiance, ThreadsDoNotChangeABit)
{
    const DropRadianceBaker baker;
    const Panorama world = street(50.0);
    const DropRadiance many = baker.bake(world);
    const ThreadLimit one(1);
    const DropRadiance alone = baker.bake(world);
    EXPECT_TRUE(
        std::equal(many.radiance.values().begin(), many.radiance.values().end(), alone.radiance.values().begin()));
    EXPECT_TRUE(std::equal(many.background.values().begin(), many.background.values().end(),
                           alone.background.values().begin()));
}

TEST(DropRadiance, SamplesAsGlDoes)
{
    ImageF map(4, 2, 3);
    for (int y = 0; y < 2; ++y) {
        for (int x = 0; x < 4; ++x) map.at(x, y, 0) = float(10 * y + x);
    }
    const auto at = [&](double x, double y) { return sampleMap(map, sh::panoramaDirection(x, y, 4, 2)).r; };
    EXPECT_NEAR(at(1.5, 0.5), 1.0, 1e-12);
    EXPECT_NEAR(at(2.0, 1.0), 6.5, 1e-12);
    EXPECT_NEAR(at(3.999999, 0.5), 1.5, 1e-5);  // half-way from the last column to the first
    EXPECT_NEAR(at(1.5, 0.1), 1.0, 1e-12);      // held beyond the first row's centres
    EXPECT_NEAR(at(1.5, 1.9), 11.0, 1e-12);
}

TEST(DropRadiance, RefusesOptionsOutOfRange)
{
    EXPECT_THROW(DropRadianceBaker({.order = 129}), Error);
    EXPECT_THROW(DropRadianceBaker({.order = -2}), Error);
    EXPECT_THROW(DropRadianceBaker({.tolerance = 0.0}), Error);
    EXPECT_THROW(DropRadianceBaker({.index = {1.0, 1.3, 1.3}}), Error);
}

}  // namespace
}  // namespace virga::environment
