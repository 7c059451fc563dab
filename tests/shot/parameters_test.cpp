#include "shot/Parameters.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "support/Files.h"

namespace virga::shot {
namespace {

using test::sentenceOf;
using test::TemporaryFolder;

template <class T>
bool holds(const Parameter& p)
{
    return std::holds_alternative<T Settings::*>(p.member);
}

bool isNumeric(const Parameter& p) { return !holds<std::string>(p) && !holds<bool>(p); }

/// How many numbers the parameter's text holds.
int numbersOf(const Parameter& p) { return holds<std::array<double, 2>>(p) ? 2 : holds<AutoColor>(p) ? 3 : 1; }

std::string repeated(const std::string& text, int times)
{
    std::string all = text;
    for (int i = 1; i < times; ++i) all += "," + text;
    return all;
}

/// Texts that the parameter must take, its ends among them.
std::vector<std::string> goodTexts(const Parameter& p)
{
    if (holds<bool>(p)) return {"true", "false"};
    if (p.choices != nullptr) {
        std::vector<std::string> words(1);
        for (const char* c = p.choices; *c != '\0'; ++c)
            if (*c == '|')
                words.emplace_back();
            else
                words.back() += *c;
        return words;
    }
    if (holds<std::string>(p)) return {"", "a.exr", "a \"b\" \\ c #1 \t[x] = é.####.exr"};
    const double third = p.least + (p.most - p.least) / 3;
    const double middle = holds<std::int64_t>(p) ? std::floor(third) : third;
    std::vector<std::string> texts;
    for (const double value : {p.least, p.most, middle})
        texts.push_back(repeated(nlohmann::json(value).dump(), numbersOf(p)));
    if (holds<AutoNumber>(p) || holds<AutoColor>(p)) texts.emplace_back("auto");
    return texts;
}

/// All settings as text: equal texts are equal settings.
std::string textOf(const Settings& settings)
{
    std::string all;
    for (const Parameter& p : parameters()) all += std::string(p.name) + " = " + toText(settings, p) + "\n";
    return all;
}

/// Runs a check on every row of the table, and says which one failed.
template <class Check>
void onEachRow(Check&& check)
{
    for (const Parameter& p : parameters()) {
        SCOPED_TRACE(std::string("--") + p.name);
        check(p);
    }
}

TEST(Parameters, AreDescribed)
{
    onEachRow([](const Parameter& p) {
        EXPECT_GT(std::string(p.name).size(), 0u);
        EXPECT_GT(std::string(p.help).size(), 8u);
        EXPECT_EQ(&findParameter(p.name), &p);
        if (isNumeric(p)) {
            EXPECT_LT(p.least, p.most);
        }
        int owners = 0;
        for (const Parameter& other : parameters()) owners += other.member == p.member;
        EXPECT_EQ(owners, 1) << "two rows set the same thing";
    });
}

TEST(Parameters, SayWhatTheirDefaultsAreOffByAndHowToMeasureIt)
{
    const std::string page = parametersPage();
    int rows = 0;
    onEachRow([&](const Parameter& p) {
        if (p.error == nullptr) return;
        ++rows;
        const std::string error = p.error;
        EXPECT_NE(error.find("(virga bench curves --only "), std::string::npos);
        EXPECT_NE(page.find(error), std::string::npos);
    });
    EXPECT_GE(rows, 5);
}

TEST(Parameters, TakeTheirOwnDefaults)
{
    onEachRow([](const Parameter& p) {
        const Settings defaults;
        Settings settings;
        setFromText(settings, p, toText(defaults, p));
        EXPECT_EQ(textOf(settings), textOf(defaults));
    });
}

TEST(Parameters, TextAndJsonComeBackTheSame)
{
    onEachRow([](const Parameter& p) {
        for (const std::string& text : goodTexts(p)) {
            Settings settings;
            setFromText(settings, p, text);
            Settings fromText;
            setFromText(fromText, p, toText(settings, p));
            EXPECT_EQ(textOf(fromText), textOf(settings)) << text;
            Settings fromJson;
            setFromJson(fromJson, p, nlohmann::json::parse(toJson(settings, p).dump()));
            EXPECT_EQ(textOf(fromJson), textOf(settings)) << text;
        }
    });
}

TEST(Parameters, SetNothingElse)
{
    onEachRow([](const Parameter& p) {
        const std::string before = textOf({});
        for (const std::string& text : goodTexts(p)) {
            Settings settings;
            setFromText(settings, p, text);
            setFromText(settings, p, toText({}, p));
            EXPECT_EQ(textOf(settings), before);
        }
    });
}

TEST(Parameters, RefuseWhatIsOutOfRange)
{
    onEachRow([](const Parameter& p) {
        const std::string flag = std::string("--") + p.name;
        const auto refused = [&](const std::string& text) {
            Settings settings;
            const std::string said = sentenceOf(ErrorCode::InvalidArgument, [&] { setFromText(settings, p, text); });
            EXPECT_SAYS(said, flag);
            EXPECT_SAYS(said, "'" + text + "'");
            EXPECT_EQ(textOf(settings), textOf({})) << "changed by what it refused: " << text;
            return said;
        };
        if (holds<bool>(p)) {
            EXPECT_SAYS(refused("maybe"), "true or false");
            refused("1");
            return;
        }
        if (p.choices != nullptr) {
            refused("explode");
            refused("");
            return;
        }
        if (!isNumeric(p)) return;
        const int n = numbersOf(p);
        const double beyond = std::max(1.0, std::abs(p.most)) * 1e-3;
        for (const std::string& word :
             {std::string("nan"), std::string("inf"), std::string("-inf"), nlohmann::json(p.least - beyond).dump(),
              nlohmann::json(p.most + beyond).dump(), std::string("1e999"), std::string("-1e999")}) {
            const std::string said = refused(repeated(word, n));
            EXPECT_SAYS(said, rangeText(p));
            EXPECT_SAYS(said, p.unit);
        }
        for (const std::string& word : {std::string(), std::string("rain"), std::string("1x"), std::string(" "),
                                        std::string("0x10"), std::string("--1"), std::string("1,2,3,4")})
            refused(word);
        if (n > 1) refused(repeated(nlohmann::json(p.least).dump(), n - 1));
        if (holds<std::int64_t>(p)) {
            EXPECT_SAYS(refused("0.5"), "whole");
        }
        Settings settings;
        EXPECT_THROW(setFromJson(settings, p, nlohmann::json::parse("{\"a\": 1}")), Error);
        EXPECT_THROW(setFromJson(settings, p, nlohmann::json::parse("[\"a\"]")), Error);
        EXPECT_THROW(setFromJson(settings, p, nullptr), Error);
        EXPECT_THROW(setFromJson(settings, p, true), Error);
    });
}

TEST(Parameters, SurviveAFile)
{
    onEachRow([](const Parameter& p) {
        const TemporaryFolder folder;
        for (const std::string& text : goodTexts(p)) {
            Settings settings;
            setFromText(settings, p, text);
            saveSettings(settings, folder / "shot.toml");
            Settings loaded;
            loadSettings(loaded, folder / "shot.toml");
            EXPECT_EQ(textOf(loaded), textOf(settings)) << text;
        }
    });
}

TEST(Parameters, NamesAreUniqueAndGroupsStayTogether)
{
    std::set<std::string> names, groups;
    std::string group;
    for (const Parameter& p : parameters()) {
        EXPECT_TRUE(names.insert(p.name).second) << p.name;
        if (group != p.group) {
            EXPECT_TRUE(groups.insert(p.group).second) << p.group << " is split";
        }
        group = p.group;
    }
}

TEST(Parameters, AMistypedNameGetsTheNearest)
{
    EXPECT_SAYS(sentenceOf(ErrorCode::InvalidArgument, [] { findParameter("rat"); }), "did you mean 'rate'");
    EXPECT_SAYS(sentenceOf(ErrorCode::InvalidArgument, [] { findParameter("threshhold"); }),
                "did you mean 'threshold'");
    const std::string said = sentenceOf(ErrorCode::InvalidArgument, [] { findParameter("zzzzzzzz"); });
    EXPECT_EQ(said.find("did you mean"), std::string::npos) << said;
}

TEST(SettingsFiles, KeysStandInTheirGroupOrAtTheTop)
{
    const TemporaryFolder folder;
    Settings settings;
    loadSettings(settings,
                 folder.write("a.toml", "rate = 80\nwind = [3, -1.5]\n[camera]\nfstop = 2.8\nfov = \"auto\"\n"));
    EXPECT_EQ(settings.rate_mm_h, 80);
    EXPECT_EQ(settings.wind_m_s[1], -1.5);
    EXPECT_EQ(settings.fstop, 2.8);
}

TEST(SettingsFiles, ErrorsNameFileAndLine)
{
    const TemporaryFolder folder;
    const auto said = [&](ErrorCode code, const std::string& text) {
        const std::string path = folder.write("bad.toml", text);
        Settings settings;
        const std::string sentence = sentenceOf(code, [&] { loadSettings(settings, path); });
        EXPECT_SAYS(sentence, path);
        return sentence;
    };
    EXPECT_SAYS(said(ErrorCode::InvalidArgument, "rate = 5\nrat = 6\n"), "line 2");
    EXPECT_SAYS(said(ErrorCode::InvalidArgument, "\n\nrate = -1\n"), "line 3");
    EXPECT_SAYS(said(ErrorCode::InvalidArgument, "rate = nan\n"), "rate");
    EXPECT_SAYS(said(ErrorCode::InvalidArgument, "rate = inf\n"), "0 to 2000");
    EXPECT_SAYS(said(ErrorCode::Input, "rate = 5\nrate 6\n"), "line 2");
    Settings settings;
    EXPECT_SAYS(sentenceOf(ErrorCode::Input, [&] { loadSettings(settings, "/no/such/shot.toml"); }),
                "/no/such/shot.toml");
    EXPECT_SAYS(sentenceOf(ErrorCode::Output, [&] { saveSettings(settings, "/no/such/folder/shot.toml"); }),
                "/no/such/folder");
}

std::string matchReport(const std::string& match)
{
    return R"({"format": "virga-extract-report", "version": 1, "footage": {"width": 640}, "match": )" + match + "}";
}

TEST(MatchFiles, AreTakenOverAndLeaveTheRest)
{
    const TemporaryFolder folder;
    Settings settings;
    settings.rate_mm_h = 3;
    settings.fstop = 2.8;
    settings.exposure_s = 0.5;
    loadMatch(settings, folder.write("report.json", matchReport(R"({"rate": 31.2, "exposure": 0.006,
        "wind": [0.8, 0], "opacity": 4.1, "fov": "auto"})")));
    Settings wanted;
    wanted.rate_mm_h = 31.2;
    wanted.fstop = 2.8;
    wanted.exposure_s = 0.006;
    wanted.wind_m_s = {0.8, 0};
    wanted.opacity = 4.1;
    EXPECT_EQ(textOf(settings), textOf(wanted));
}

TEST(MatchFiles, TakeEveryParameter)
{
    onEachRow([](const Parameter& p) {
        if (std::string(p.name) == "mattes") return;  // below
        const TemporaryFolder folder;
        for (const std::string& text : goodTexts(p)) {
            Settings settings, matched;
            setFromText(settings, p, text);
            const nlohmann::json match = {{p.name, toJson(settings, p)}};
            loadMatch(matched, folder.write("report.json", matchReport(match.dump())));
            EXPECT_EQ(textOf(matched), textOf(settings)) << text;
        }
    });
}

TEST(MatchFiles, UndoWhatWouldOutrankThem)
{
    const TemporaryFolder folder;
    const auto matched = [&](const std::string& match) {
        Settings settings;
        settings.strokes = 1000;
        settings.exposure_s = 0.5;
        loadMatch(settings, folder.write("report.json", matchReport(match)));
        return settings;
    };
    EXPECT_FALSE(matched(R"({"rate": 5})").strokes);
    EXPECT_EQ(matched(R"({"rate": 5, "strokes": 70})").strokes, 70);
    EXPECT_EQ(matched(R"({"opacity": 5})").strokes, 1000);
    EXPECT_FALSE(matched(R"({"shutter": 90})").exposure_s);
    EXPECT_EQ(matched(R"({"rate": 5})").exposure_s, 0.5);
}

TEST(MatchFiles, FindTheirMattesBesideThem)
{
    const TemporaryFolder folder;
    const auto mattesOf = [&](const std::string& match, const std::string& before) {
        Settings settings;
        settings.mattes = before;
        loadMatch(settings, folder.write("report.json", matchReport(match)));
        return settings.mattes;
    };
    EXPECT_EQ(mattesOf(R"({"mattes": "atlas.exr"})", ""), folder / "atlas.exr");
    EXPECT_EQ(mattesOf(R"({"mattes": "/elsewhere/atlas.exr"})", ""), "/elsewhere/atlas.exr");
    EXPECT_EQ(mattesOf(R"({"mattes": ""})", "mine.exr"), "");
    EXPECT_EQ(mattesOf(R"({"rate": 5})", "mine.exr"), "mine.exr") << "what the report does not name is not moved";
}

TEST(MatchFiles, ErrorsNameTheFileAndChangeNothing)
{
    const TemporaryFolder folder;
    const auto said = [&](ErrorCode code, const std::string& text) {
        const std::string path = folder.write("report.json", text);
        Settings settings;
        const std::string sentence = sentenceOf(code, [&] { loadMatch(settings, path); });
        EXPECT_SAYS(sentence, "'" + path + "'");
        EXPECT_EQ(sentence.find('\n'), std::string::npos) << sentence;
        EXPECT_EQ(textOf(settings), textOf({})) << "changed by what it refused: " << text;
        return sentence;
    };
    const ErrorCode input = ErrorCode::Input, value = ErrorCode::InvalidArgument;
    for (const std::string& text :
         {std::string(), std::string("rate = 5\n"), std::string("{\"format\": "), std::string("\xff\xfe\0{}", 5)})
        EXPECT_SAYS(said(input, text), "not JSON");
    for (const char* text : {"{}", "[]", "null", "7", R"({"format": "virga-env-report", "version": 1})",
                             R"({"format": {}, "version": 1, "match": {}})"})
        EXPECT_SAYS(said(input, text), "no report of virga extract");
    EXPECT_SAYS(said(input, R"({"format": "virga-extract-report", "version": 2, "match": {}})"), "version 2");
    EXPECT_SAYS(said(input, R"({"format": "virga-extract-report", "version": "1", "match": {}})"), "version \"1\"");
    EXPECT_SAYS(said(input, R"({"format": "virga-extract-report", "match": {}})"), "version unknown");
    EXPECT_SAYS(said(input, matchReport("null")), "no rain");
    EXPECT_SAYS(said(input, R"({"format": "virga-extract-report", "version": 1})"), "no rain");
    EXPECT_SAYS(said(input, matchReport("[1, 2]")), "[1,2]");
    EXPECT_SAYS(said(value, matchReport(R"({"exposure": 0.01, "rat": 3})")), "did you mean 'rate'");
    EXPECT_SAYS(said(value, matchReport(R"({"exposure": 0.01, "rate": 2001})")),
                "--rate '2001': must be 0 to 2000 mm/h");
    EXPECT_SAYS(said(value, matchReport(R"({"rate": null})")), "--rate");
    EXPECT_SAYS(said(value, matchReport(R"({"wind": [1]})")), "2 numbers");
    EXPECT_SAYS(said(value, matchReport(R"({"mattes": "a.exr", "wind": {"x": 1}})")), "--wind");
    Settings settings;
    EXPECT_SAYS(sentenceOf(input, [&] { loadMatch(settings, folder / "none.json"); }), "no such file");
    EXPECT_SAYS(sentenceOf(input, [&] { loadMatch(settings, folder.path()); }), "is a folder");
}

}  // namespace
}  // namespace virga::shot
