#include <algorithm>
#include <cstdint>
#include <filesystem>

#include "fuzz/Targets.h"
#include "io/Ffv1Checksum.h"
#include "io/Plate.h"
#include "io/PlateName.h"
#include "io/PngCheck.h"

namespace virga::fuzz {

namespace {

/// A pattern or a name.
void takePattern(std::string_view input)
{
    const std::string pattern(input);
    // Paths and what the system says of them end at a zero byte, and no name is longer than this.
    if (pattern.find('\0') != std::string::npos || pattern.size() > 200) return;
    const std::size_t slash = pattern.rfind('/');
    const std::string folder = slash == std::string::npos ? "" : pattern.substr(0, slash + 1);
    for (const FrameNumber frame : {FrameNumber(0), FrameNumber(7), FrameNumber(-12), FrameNumber(1234567),
                                    FrameNumber(INT64_MAX), FrameNumber(INT64_MIN)}) {
        const std::string path = io::framePath(pattern, frame);
        require(path.starts_with(folder), "the number stands in the last part of the path");
        require(path.find('/', folder.size()) == std::string::npos, "a frame's number makes no folder");
        if (io::isFramePattern(pattern))
            require(io::frameNumberOf(pattern, path.substr(folder.size())) == frame, "a frame's name tells the frame");
        else
            require(path == pattern, "a name is itself");
    }
    if (!isOneLine(pattern)) return;  // what is typed is repeated as it was typed
    const bool isOne = answers({ErrorCode::Input}, [&] { io::refuseTwoPatterns(pattern, ErrorCode::Input); });
    require(isOne || io::isFramePattern(pattern), "only patterns are refused as two");
    io::frameNumberOf(pattern, pattern);
    io::frameNumberIn(pattern);
}

/// A file name looked at as a frame of a pattern: pattern and name with a zero byte between.
void takeFrameName(std::string_view input)
{
    const std::size_t cut = std::min(input.find('\0'), input.size());
    const std::string pattern(input.substr(0, cut)), name(input.substr(std::min(cut + 1, input.size())));
    if (pattern.size() > 200) return;
    if (const auto frame = io::frameNumberOf(pattern, name)) {
        const std::string path = io::framePath(pattern, *frame);
        require(path.ends_with(name), "the frame that a name tells has that name");
    }
    if (const auto frame = io::frameNumberIn(name))
        require(name.find(std::to_string(*frame < 0 ? 0 - std::uint64_t(*frame) : std::uint64_t(*frame))) !=
                    std::string::npos,
                "the number stands in the name");
}

void takePng(std::string_view input)
{
    const std::string path = fileOf(input);
    if (const auto damage = io::damageOfPng(path)) {
        require(!damage->empty(), "the damage is named");
        require(isOneLine(*damage), "the damage is named in text");
    }
    if (const auto codes = io::cicpOfPng(path))
        for (const int code : *codes) require(code >= 0 && code < 256, "each code is a byte");
    io::isPngWithoutColorspace(path);
}

void takeFfv1Packet(std::string_view input)
{
    io::checkFfv1Packet(reinterpret_cast<const std::uint8_t*>(input.data()), input.size());
}

/// A PNG of one grey pixel: signature, IHDR, cICP, IDAT and IEND with their checksums.
const std::uint8_t png[] = {
    0x89, 'P', 'N', 'G',  '\r', '\n', 0x1a, '\n', 0,    0,    0,    13,   'I', 'H', 'D', 'R',  0,    0,    0,    1,   0,
    0,    0,   1,   8,    0,    0,    0,    0,    0x3a, 0x7e, 0x9b, 0x55, 0,   0,   0,   4,    'c',  'I',  'C',  'P', 9,
    16,   0,   1,   0x4e, 0x1f, 0x8c, 0x5d, 0,    0,    0,    10,   'I',  'D', 'A', 'T', 0x78, 0x9c, 0x63, 0x60, 0,   0,
    0,    2,   0,   1,    0x48, 0xaf, 0xa4, 0x71, 0,    0,    0,    0,    'I', 'E', 'N', 'D',  0xae, 0x42, 0x60, 0x82};

}  // namespace

std::vector<Target> ioTargets()
{
    using namespace std::string_literals;
    std::string packet(200, '\x11');
    packet[packet.size() - 6] = '\xc0';  // the size of the last slice
    return {{"frame-pattern",
             takePattern,
             {"a/shot.%04d.exr", "s.####.exr", "s.@@.png", "s.$F4.exr", "take#2.%04d.exr", "%d", "s.%3d.exr",
              "a.%04d.%04d.exr", "still.0012.exr", "s_-3.exr"},
             {"%04d", "%d", "####", "@", "$F", "$F4", "/", ".exr", "%999d"}},
            {"frame-name",
             takeFrameName,
             {"s.%04d.exr\0s.0012.exr"s, "s.%3d.exr\0s. -7.exr"s, "####.png\0-012.png"s,
              "$F\0"
              "123456"s},
             {"%04d", "\0"s, "-", "0", " "}},
            {"png-chunks",
             takePng,
             {std::string(reinterpret_cast<const char*>(png), sizeof png)},
             {"IHDR", "IDAT", "IEND", "cICP", "sRGB", "gAMA", "iCCP", "\0\0\0\0"s, "\xff\xff\xff\xff"s}},
            {"ffv1-packet", takeFfv1Packet, {packet, std::string(12, '\0')}, {}}};
}

}  // namespace virga::fuzz
