// Seeded changes of good inputs through every entry of Targets.h, which end the program at anything that is neither an
// answer nor a sentence. scripts/fuzz.sh looks for more, with libFuzzer.
#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>
#include <random>

#include "core/Log.h"
#include "fuzz/Targets.h"

namespace virga::fuzz {

void PrintTo(const Target& target, std::ostream* out) { *out << target.name; }

namespace {

class Mutations : public testing::TestWithParam<Target> {};

std::string changed(std::string input, const Target& target, std::mt19937& random)
{
    constexpr char bytes[] = "0123456789.-+eE[]{}\",: \n\t#nanif\xff\x00";
    for (int change = int(random() % 5); change > 0; --change) {
        const std::size_t at = random() % (input.size() + 1), length = std::size_t(1) << random() % 6;
        const char byte = random() % 2 == 0 ? bytes[random() % (sizeof bytes - 1)] : char(random());
        switch (random() % 6) {
            case 0: input.insert(at, 1, byte); break;
            case 1: input.insert(at, input.substr(at, length)); break;
            case 2: input.erase(at, length); break;
            case 3:
                if (!target.words.empty()) input.insert(at, target.words[random() % target.words.size()]);
                break;
            case 4: input.resize(at); break;
            default:
                if (at < input.size()) input[at] = byte;
        }
    }
    return input;
}

TEST_P(Mutations, AreAnswersOrSentences)
{
    log::setLevel(log::Level::Quiet);
    const Target& target = GetParam();
    std::mt19937 random(11);
    target.take("");
    for (const std::string& seed : target.seeds)
        for (std::size_t size = 0; size <= seed.size(); ++size) target.take(seed.substr(0, size));
    for (int i = 0; i < 30'000; ++i)
        target.take(changed(target.seeds[std::size_t(i) % target.seeds.size()], target, random));
}

/// `before` over and over, `middle`, and `after` as often.
std::string nested(const char* before, const char* middle = "", const char* after = "")
{
    constexpr std::size_t bytes = 200'000;
    std::string text;
    const std::size_t times = bytes / std::string(before).size();
    for (std::size_t i = 0; i < times; ++i) text += before;
    text += middle;
    for (std::size_t i = 0; i < times; ++i) text += after;
    return text;
}

/// Deep nesting, long lists and long words: recursion must not take the stack, nor anything the memory or the day.
TEST_P(Mutations, SurviveExcess)
{
    log::setLevel(log::Level::Quiet);
    const Target& target = GetParam();
    std::vector<std::string> excess = {nested("[", "0", "]"), nested("{\"a\":", "0", "}"), nested("[0,", "0", "]"),
                                       nested("\"x", "\""), nested("1e", "9")};
    for (const char* piece : {"[", "{\"a\":", "0", "9", "-", " ", "\n", "a", "[0],", "#", "%", "\xff", ".", "0,"})
        excess.push_back(nested(piece));
    for (const std::string& seed : target.seeds)
        for (const std::string& many : excess) {
            target.take(seed + many);
            target.take(many + seed);
            // In place of each value.
            for (std::size_t at = 0; (at = seed.find_first_of(":=", at)) != std::string::npos; ++at) {
                const std::size_t end = std::min(seed.find_first_of(",}\n", at), seed.size());
                target.take(seed.substr(0, at + 1) + many + seed.substr(end));
            }
        }
}

std::string nameOf(const testing::TestParamInfo<Target>& info)
{
    std::string name = info.param.name;
    std::replace(name.begin(), name.end(), '-', '_');
    return name;
}

INSTANTIATE_TEST_SUITE_P(Parsers, Mutations, testing::ValuesIn(targets()), nameOf);

}  // namespace
}  // namespace virga::fuzz
