// The parsers of ours, each as an entry that takes any bytes: what they answer, or an Error that says so in one line,
// is what their headers promise; anything else ends the program. libFuzzer drives the entries (fuzzer.cpp,
// scripts/fuzz.sh), and so does a test that needs no libFuzzer (mutation_test.cpp).
#pragma once

#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "core/Error.h"

namespace virga::fuzz {

struct Target {
    const char* name;
    void (*take)(std::string_view input);
    std::vector<std::string> seeds;  ///< good inputs, to be changed
    std::vector<std::string> words;  ///< of the format, to be put in; libFuzzer's dictionary
};

std::vector<Target> coreTargets();
std::vector<Target> cameraTargets();
std::vector<Target> matteTargets();
std::vector<Target> ioTargets();
std::vector<Target> shotTargets();
std::vector<Target> serverTargets();
/// All of them.
std::vector<Target> targets();

/// Ends the program, with the law that was broken, unless `holds`.
inline void require(bool holds, const char* law, std::string_view by = "")
{
    if (holds) return;
    std::fprintf(stderr, "broken: %s%s%.*s\n", law, by.empty() ? "" : ": ", int(by.size()), by.data());
    std::abort();
}

/// Whether a terminal shows it as it is.
inline bool isOneLine(std::string_view text)
{
    for (const unsigned char c : text)
        if (c < ' ' || c == 0x7f) return false;
    return true;
}

/// Runs `parse`, which may throw Error of one of `codes` alone, with a sentence on one line. True if it did not.
template <class Parse>
bool answers(std::initializer_list<ErrorCode> codes, Parse&& parse)
{
    try {
        parse();
        return true;
    } catch (const Error& error) {
        bool isExpected = false;
        for (const ErrorCode code : codes) isExpected = isExpected || code == error.code();
        require(isExpected, "the error's code is one that the header names");
        const std::string_view sentence = error.what();
        require(!sentence.empty(), "the error says something");
        require(isOneLine(sentence), "the sentence is one line of text", sentence);
        return false;
    }
}

/// A file that holds `content`, for parsers that take a path; the same one for all calls, so one at a time.
std::string fileOf(std::string_view content);

}  // namespace virga::fuzz
