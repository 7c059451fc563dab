#include "plot/Chart.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <regex>

namespace virga::plot {
namespace {

TEST(Ticks, AreRoundFewAndInside)
{
    for (const double size : {1e-9, 0.003, 0.7, 1.0, 42.0, 1e3, 7e12}) {
        for (const double low : {0.0, -0.31 * size, 12.7 * size, -100.0 * size}) {
            for (const int most : {2, 5, 8}) {
                const auto found = ticks(low, low + size, Scale::Linear, most);
                EXPECT_LE(int(found.size()), most) << low << " " << size;
                for (std::size_t i = 0; i < found.size(); ++i) {
                    EXPECT_GE(found[i], low - 1e-6 * size);
                    EXPECT_LE(found[i], low + size * (1 + 1e-6));
                    if (i == 0) continue;
                    const double step = found[i] - found[i - 1];
                    const double digit = step / std::pow(10.0, std::floor(std::log10(step) + 1e-6));
                    EXPECT_LT(std::min({std::abs(digit - 1), std::abs(digit - 2), std::abs(digit - 5)}), 1e-4) << step;
                    EXPECT_NEAR(std::remainder(found[i], step) / step, 0.0, 1e-6);
                }
                if (most == 8) {
                    EXPECT_GE(found.size(), 3u) << low << " " << size;
                }
            }
        }
    }
}

TEST(Ticks, OfLogarithmicAxesAreDecades)
{
    EXPECT_EQ(ticks(-3.0, 1.0, Scale::Logarithmic, 8), (std::vector<double>{-3, -2, -1, 0, 1}));
    EXPECT_EQ(ticks(-12.0, 0.0, Scale::Logarithmic, 7), (std::vector<double>{-12, -10, -8, -6, -4, -2, 0}));
    // Two decades have room for 2 and 5, less than one for round values.
    const auto two = ticks(0.0, 2.0, Scale::Logarithmic, 8);
    ASSERT_EQ(two.size(), 7u);
    EXPECT_NEAR(two[1], std::log10(2.0), 1e-12);
    EXPECT_NEAR(two[2], std::log10(5.0), 1e-12);
    for (const double place : ticks(std::log10(3.0), std::log10(7.0), Scale::Logarithmic, 8))
        EXPECT_NEAR(std::pow(10.0, place), std::round(std::pow(10.0, place)), 1e-9);
}

TEST(TickLabel, SaysTheValueAndNoMore)
{
    EXPECT_EQ(tickLabel(0.1 + 0.2, 0.1, Scale::Linear), "0.3");
    EXPECT_EQ(tickLabel(0.25, 0.25, Scale::Linear), "0.25");
    EXPECT_EQ(tickLabel(-1e-17, 0.5, Scale::Linear), "0");
    EXPECT_EQ(tickLabel(-2.0, 2.0, Scale::Linear), "−2");
    EXPECT_EQ(tickLabel(120.0, 20.0, Scale::Linear), "120");
    EXPECT_EQ(tickLabel(-4.0, 1.0, Scale::Logarithmic), "10⁻⁴");
    EXPECT_EQ(tickLabel(12.0, 2.0, Scale::Logarithmic), "10¹²");
    EXPECT_EQ(tickLabel(4.0, 1.0, Scale::Logarithmic), "10000");
    EXPECT_EQ(tickLabel(std::log10(2e-4), 1.0, Scale::Logarithmic), "2·10⁻⁴");
    EXPECT_EQ(tickLabel(std::log10(0.5), 0.1, Scale::Logarithmic), "0.5");
    EXPECT_EQ(tickLabel(-30.0, 10.0, Scale::Decibel), "−30");
}

/// The numbers of the first path drawn with the colour.
std::vector<double> pathOf(const std::string& document, const std::string& color)
{
    std::vector<double> numbers;
    std::string path;
    // The legend's own stroke ends in h24; the curve comes after it.
    const std::regex curve("stroke=\"" + color + "\"[^>]* d=\"(M[^\"h]*)\"");
    std::smatch match;
    if (std::regex_search(document, match, curve)) path = match[1];
    const std::regex number("-?[0-9]+\\.[0-9]+");
    for (std::sregex_iterator i(path.begin(), path.end(), number), end; i != end; ++i)
        numbers.push_back(std::stod(i->str()));
    return numbers;
}

TEST(Chart, PutsValuesWhereTheAxesSay)
{
    // Straight on a logarithmic axis, on decibels, and on both linear: the same picture.
    std::vector<double> shape;
    for (const Scale scale : {Scale::Linear, Scale::Logarithmic, Scale::Decibel}) {
        const auto y = [&](double place) {
            return scale == Scale::Linear ? place : std::pow(10.0, scale == Scale::Decibel ? place / 10 : place);
        };
        const Chart chart{.title = "",
                          .x = {.low = 0, .high = 4},
                          .y = {.scale = scale, .low = y(1), .high = y(3)},
                          .series = {{.name = "a", .x = {0, 2, 4}, .y = {y(1), y(2.5), y(3)}, .color = "#123456"}}};
        const auto path = pathOf(svg({&chart, 1}), "#123456");
        ASSERT_EQ(path.size(), 6u);
        EXPECT_NEAR(path[2], 0.5 * (path[0] + path[4]), 0.011);
        EXPECT_NEAR(path[3], 0.25 * path[1] + 0.75 * path[5], 0.011);
        EXPECT_LT(path[5], path[1]);  // up is up
        if (shape.empty()) shape = path;
        for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(path[i], shape[i], 0.011);
    }
}

TEST(Chart, EqualScalesKeepCirclesRound)
{
    Series circle{.name = "", .color = "#123456"};
    for (int i = 0; i <= 64; ++i) {
        circle.x.push_back(3 + std::cos(0.0981747704 * i));
        circle.y.push_back(std::sin(0.0981747704 * i));
    }
    const Chart chart{.title = "circle", .series = {circle}, .equalScales = true};
    const auto path = pathOf(svg({&chart, 1}), "#123456");
    ASSERT_EQ(path.size(), 130u);
    EXPECT_NEAR(path[0] - path[64], path[2 * 48 + 1] - path[2 * 16 + 1], 0.03);
    EXPECT_GT(path[0] - path[64], 200.0);
}

TEST(Chart, BreaksTheLineWhereThereIsNoValue)
{
    const double nothing = std::numeric_limits<double>::quiet_NaN();
    const Chart chart{
        .title = "",
        .y = {.scale = Scale::Logarithmic},
        .series = {
            {.x = {0, 1, 2, 3, 4, 5, 6, 7}, .y = {1, 2, nothing, 3, 4, 0, 5, 6}, .markers = true, .color = "#123456"}}};
    const std::string document = svg({&chart, 1});
    std::smatch match;
    ASSERT_TRUE(std::regex_search(document, match, std::regex("stroke=\"#123456\" d=\"([^\"]*)\"")));
    const std::string path = match[1];
    EXPECT_EQ(std::count(path.begin(), path.end(), 'M'), 3);
    EXPECT_EQ(std::count(path.begin(), path.end(), 'L'), 3);
    EXPECT_EQ(document.find("nan"), std::string::npos);
    std::size_t dots = 0;
    for (std::size_t at = document.find("<circle"); at != std::string::npos; at = document.find("<circle", at + 1))
        ++dots;
    EXPECT_EQ(dots, 6u);
}

TEST(Chart, NeedsNoDataAndNoRange)
{
    const std::vector<Chart> charts{
        {.title = "none"},
        {.title = "one", .series = {{.x = {3}, .y = {5}}}},
        {.title = "level", .series = {{.x = {0, 1}, .y = {-7, -7}}}},
        {.title = "below", .y = {.scale = Scale::Logarithmic}, .series = {{.x = {0}, .y = {-1}}}}};
    const std::string document = svg(charts);
    EXPECT_EQ(document.find("nan"), std::string::npos);
    EXPECT_EQ(document.find("inf"), std::string::npos);
    EXPECT_NE(document.find("viewBox=\"0 0 760 1720\""), std::string::npos);
}

TEST(Chart, EscapesWhatXmlCannotHold)
{
    const Chart chart{.title = "a < b & \"c\" > d", .series = {{.name = "<script>", .x = {0}, .y = {0}}}};
    const std::string document = svg({&chart, 1});
    EXPECT_NE(document.find("a &lt; b &amp; &quot;c&quot; &gt; d"), std::string::npos);
    EXPECT_EQ(document.find("<script>"), std::string::npos);
}

}  // namespace
}  // namespace virga::plot
