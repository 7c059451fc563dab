#include "io/PngCheck.h"

extern "C" {
#include <libavutil/crc.h>
}

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <vector>

#include "core/Error.h"

namespace virga::io {

namespace {

std::uint32_t bigEndian(const std::uint8_t* b)
{
    return std::uint32_t(b[0]) << 24 | std::uint32_t(b[1]) << 16 | std::uint32_t(b[2]) << 8 | b[3];
}

constexpr std::array<std::uint8_t, 8> pngSignature = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};

}  // namespace

std::optional<std::string> damageOfPng(const std::string& path)
{
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) return std::nullopt;  // a pipe can be read only once
    std::ifstream file(path, std::ios::binary);
    const auto read = [&](std::uint8_t* to, std::size_t size) {
        return bool(file.read(reinterpret_cast<char*>(to), std::streamsize(size)));
    };
    std::array<std::uint8_t, 8> signature{};
    if (!read(signature.data(), signature.size()) || signature != pngSignature) return std::nullopt;

    const AVCRC* table = av_crc_get_table(AV_CRC_32_IEEE_LE);
    std::vector<std::uint8_t> piece(std::size_t(1) << 16);
    for (;;) {
        std::array<std::uint8_t, 8> head{};  // length, type
        if (!read(head.data(), head.size())) return "it ends before its last chunk";
        const std::string type(reinterpret_cast<const char*>(head.data()) + 4, 4);
        if (!std::all_of(type.begin(), type.end(),
                         [](char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }))
            return "a chunk has no name";
        std::uint32_t sum = av_crc(table, 0xffffffffu, head.data() + 4, 4);
        for (std::size_t left = bigEndian(head.data()); left > 0;) {
            const std::size_t size = std::min(left, piece.size());
            if (!read(piece.data(), size)) return fmt::format("it ends inside a chunk {}", type);
            sum = av_crc(table, sum, piece.data(), size);
            left -= size;
        }
        std::array<std::uint8_t, 4> stored{};
        if (!read(stored.data(), stored.size())) return fmt::format("it ends inside a chunk {}", type);
        // Chunks in lower case are remarks, which libpng passes over if they are wrong.
        const bool isNeeded = type[0] >= 'A' && type[0] <= 'Z';
        if (isNeeded && bigEndian(stored.data()) != (sum ^ 0xffffffffu))
            return fmt::format("the checksum of a chunk {} is wrong", type);
        if (type == "IEND") return std::nullopt;
    }
}

namespace {

/// Calls look(type, file) at the data of each chunk before the pixels, until it says that it has seen enough. False if
/// the file is no PNG or ends before its pixels.
template <class Look>
bool lookAtChunks(const std::string& path, const Look& look)
{
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) return false;
    std::ifstream file(path, std::ios::binary);
    std::array<std::uint8_t, 8> head{};  // the signature, then length and type of each chunk
    const auto read = [&] { return bool(file.read(reinterpret_cast<char*>(head.data()), head.size())); };
    if (!read() || head != pngSignature) return false;
    while (read()) {
        const std::string type(reinterpret_cast<const char*>(head.data()) + 4, 4);
        const auto data = file.tellg();
        if (type == "IDAT" || look(type, file)) return true;
        file.seekg(data + std::streamoff(bigEndian(head.data())) + std::streamoff(4));
    }
    return false;
}

}  // namespace

bool isPngWithoutColorspace(const std::string& path)
{
    bool isSaid = false;
    const bool isPng = lookAtChunks(path, [&](const std::string& type, std::istream&) {
        for (const char* word : {"sRGB", "gAMA", "cHRM", "iCCP", "cICP"}) isSaid = isSaid || type == word;
        return isSaid;
    });
    return isPng && !isSaid;
}

std::optional<std::array<int, 3>> cicpOfPng(const std::string& path)
{
    std::optional<std::array<int, 3>> found;
    lookAtChunks(path, [&](const std::string& type, std::istream& file) {
        std::array<char, 4> data{};
        if (type != "cICP" || !file.read(data.data(), data.size())) return false;
        found = {static_cast<std::uint8_t>(data[0]), static_cast<std::uint8_t>(data[1]),
                 static_cast<std::uint8_t>(data[2])};
        return true;
    });
    return found;
}

}  // namespace virga::io
