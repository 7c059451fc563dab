// Tables and charts of curves, from points made by hand.
#include <gtest/gtest.h>

#include <algorithm>

#include "bench/CurveReport.h"

namespace virga::bench {
namespace {

Knob twoMeasures()
{
    Knob knob;
    knob.name = "knob";
    knob.title = "--knob";
    knob.against = "the truth";
    knob.baseline = "another seed";
    knob.values = {0.1, 1, 10};
    knob.standard = 1;
    knob.measures = {{"rmse", "RMSE"}, {"flip", "FLIP"}};
    return knob;
}

std::vector<Point> threeValuesTwoSeeds()
{
    std::vector<Point> points;
    for (const std::int64_t seed : {1, 2})
        for (const double value : {0.1, 1.0, 10.0})
            points.push_back({"street", "", value, seed, 2 * value, {value * double(seed), 0.5}});
    points.push_back({"street", "", {}, 2, 1, {3, 0.25}});
    return points;
}

TEST(Summary, IsTheMeanAndTheSpreadOverSeeds)
{
    const std::vector<Summary> rows = summarize(threeValuesTwoSeeds());
    ASSERT_EQ(rows.size(), 4u);
    EXPECT_EQ(rows[2].value, 10);
    EXPECT_EQ(rows[2].seeds, 2u);
    EXPECT_DOUBLE_EQ(rows[2].ms, 20);
    EXPECT_DOUBLE_EQ(rows[2].mean[0], 15);
    EXPECT_DOUBLE_EQ(rows[2].least[0], 10);
    EXPECT_DOUBLE_EQ(rows[2].largest[0], 20);
    EXPECT_FALSE(rows[3].value);
}

TEST(CurveTable, HasARowAPointAndAColumnAMeasure)
{
    const std::string csv = curveTable(twoMeasures(), threeValuesTwoSeeds());
    EXPECT_EQ(csv.substr(0, csv.find('\n')), "clip,variant,value,seed,ms,rmse,flip");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 8);
    EXPECT_EQ(std::count(csv.begin(), csv.end(), ','), 8 * 6);
    EXPECT_NE(csv.find("street,,10,2,20.0000,20,0.5\n"), std::string::npos);
    EXPECT_NE(csv.find("street,,,2,1.0000,3,0.25\n"), std::string::npos) << "the base line has no value";
}

TEST(CurveTable, QuotesCommas)
{
    const std::string csv = curveTable(twoMeasures(), {{"5 strokes, \"thin\"", "", 1.0, 1, 2, {3, 4}}});
    EXPECT_NE(csv.find("\n\"5 strokes, \"\"thin\"\"\",,1,1,2.0000,3,4\n"), std::string::npos) << csv;
}

TEST(CurveCharts, MarkTheDefaultAndTheBaseLine)
{
    const std::string svg = curveCharts(twoMeasures(), threeValuesTwoSeeds());
    EXPECT_NE(svg.find(">default<"), std::string::npos);
    EXPECT_NE(svg.find(">another seed<"), std::string::npos);
    EXPECT_NE(svg.find("<svg"), std::string::npos);
    // Without a point at the default there is nothing to mark.
    Knob elsewhere = twoMeasures();
    elsewhere.standard = 5;
    EXPECT_EQ(curveCharts(elsewhere, threeValuesTwoSeeds()).find(">default<"), std::string::npos);
}

TEST(Knobs, HaveTheirDefaultAmongTheirValues)
{
    std::vector<std::string> names;
    for (const Knob& knob : allKnobs()) {
        EXPECT_NE(std::find(knob.values.begin(), knob.values.end(), knob.standard), knob.values.end()) << knob.name;
        EXPECT_FALSE(knob.measures.empty()) << knob.name;
        EXPECT_FALSE(knob.against.empty()) << knob.name;
        EXPECT_EQ(std::count(names.begin(), names.end(), knob.name), 0) << knob.name;
        names.push_back(knob.name);
    }
    EXPECT_EQ(names.size(), 17u);
}

}  // namespace
}  // namespace virga::bench
