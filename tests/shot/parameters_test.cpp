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

}  // namespace
}  // namespace virga::shot
