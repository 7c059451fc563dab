// What the tests of this folder share: a folder that goes away, FFmpeg's own tools as the other opinion, pictures with
// something in them.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/Error.h"
#include "core/Image.h"
#include "io/Plate.h"
#include "support/Files.h"

namespace virga::io::test {

/// A folder of its own for a test, removed with everything in it.
class TemporaryFolder {
public:
    TemporaryFolder();
    ~TemporaryFolder();
    /// Path of a file in it.
    std::string operator/(const std::string& name) const { return (path_ / name).string(); }
    const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
};

/// Runs a shell command and gives what it wrote on standard output; fails the test if it does not end well.
std::string run(const std::string& command);

/// Frames of FFmpeg's moving test card with noise that differs in each: ffmpeg ... -i <source> <arguments> path.
void makeMovie(const std::string& path, const std::string& arguments, int frames = 12,
               const std::string& size = "64x48", const std::string& source = "testsrc2",
               const std::string& rate = "25");

/// One MD5 a frame of the decoded video codes, by ffmpeg.
std::vector<std::string> frameHashes(const std::string& path, const std::string& arguments = "");

/// Fails unless ffmpeg decodes the same codes from both files of each pair.
void expectSameFrames(const std::vector<std::pair<std::string, std::string>>& pairs);

/// Plate to result with nothing done to it. Returns the number of frames.
std::size_t copyPlate(const std::string& from, const std::string& to, const WriteOptions& write = {},
                      const ReadOptions& read = {}, const std::vector<FrameNumber>& frames = {});

using virga::test::sentenceOf;

/// RGBA noise between `low` and `high` (alpha 0..1), the same for the same seed.
ImageF noise(int width, int height, int channels, float low, float high, std::uint32_t seed = 1);

bool sameBits(ConstImageViewF a, ConstImageViewF b);

/// Real footage, or an empty path if VIRGA_FOOTAGE_DIR is not set.
std::string footage(const std::string& name);
#define SKIP_WITHOUT_FOOTAGE(path) \
    if ((path).empty()) GTEST_SKIP() << "VIRGA_FOOTAGE_DIR is not set or lacks the clip"

}  // namespace virga::io::test
