#include "server/RawFrame.h"

#include <algorithm>
#include <cstring>

#include "core/Parallel.h"
#include "io/HalfRow.h"
#include "server/Refusal.h"

namespace virga::server {
namespace {

constexpr std::string_view magic = "VIRGARAW";
constexpr std::size_t fixedBytes = 64, nameBytes = 32, mostPlanes = 64;
constexpr int mostSide = 16384;

std::size_t filledUp(std::size_t bytes) { return (bytes + 63) / 64 * 64; }

template <class T>
void put(std::byte* to, std::size_t at, T value)
{
    std::memcpy(to + at, &value, sizeof value);
}

template <class T>
T get(std::string_view bytes, std::size_t at)
{
    T value;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
}

[[noreturn]] void refuse(const char* why) { throw Refusal(400, "bad-raw", "the raw frame {}", why); }

}  // namespace

std::size_t RawHeader::headerBytes() const { return filledUp(fixedBytes + planes.size() * nameBytes); }

std::size_t RawHeader::planeBytes() const
{
    return filledUp(std::size_t(data.width) * std::size_t(data.height) * (isFloat ? 4 : 2));
}

void writeRaw(const RawHeader& header, std::span<const RawPlane> planes, std::byte* to)
{
    std::memset(to, 0, header.headerBytes());
    std::memcpy(to, magic.data(), magic.size());
    put(to, 8, std::uint32_t(1));
    put(to, 12, std::uint32_t(header.headerBytes()));
    put(to, 16, header.data);
    put(to, 32, std::int32_t(header.frameWidth));
    put(to, 36, std::int32_t(header.frameHeight));
    put(to, 40, std::int64_t(header.frame));
    put(to, 48, std::uint32_t(header.isFloat ? 4 : 2));
    put(to, 52, std::uint32_t(planes.size()));
    put(to, 56, std::uint64_t(header.planeBytes()));
    for (std::size_t p = 0; p < planes.size(); ++p)
        std::memcpy(to + fixedBytes + p * nameBytes, header.planes[p].data(),
                    std::min(header.planes[p].size(), nameBytes - 1));
    const int width = header.data.width, height = header.data.height;
    for (std::size_t p = 0; p < planes.size(); ++p) {
        const RawPlane& plane = planes[p];
        std::byte* const out = to + header.headerBytes() + p * header.planeBytes();
        const std::size_t rowBytes = std::size_t(width) * (header.isFloat ? 4 : 2);
        parallelFor(0, height, 32, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (auto y = int(first); y < int(last); ++y) {
                std::byte* row = out + std::size_t(y) * rowBytes;
                const float* from = plane.pixels.row(y) + plane.channel;
                const auto step = std::size_t(plane.pixels.channels());
                if (header.isFloat)
                    for (int x = 0; x < width; ++x) std::memcpy(row + 4 * x, from + std::size_t(x) * step, 4);
                else
                    io::halvesFromFloats(from, step, row, 2, std::size_t(width));
            }
        });
        const std::size_t used = rowBytes * std::size_t(height);
        std::memset(out + used, 0, header.planeBytes() - used);
    }
}

RawHeader parseRawHeader(std::string_view bytes)
{
    if (bytes.size() < fixedBytes || bytes.substr(0, magic.size()) != magic) refuse("does not begin with VIRGARAW");
    if (get<std::uint32_t>(bytes, 8) != 1) refuse("is of another version than 1");
    RawHeader header;
    header.data = get<Window>(bytes, 16);
    header.frameWidth = get<std::int32_t>(bytes, 32);
    header.frameHeight = get<std::int32_t>(bytes, 36);
    header.frame = get<std::int64_t>(bytes, 40);
    const auto sample = get<std::uint32_t>(bytes, 48);
    if (sample != 2 && sample != 4) refuse("has samples of neither 2 nor 4 bytes");
    header.isFloat = sample == 4;
    for (const int side : {header.data.width, header.data.height, header.frameWidth, header.frameHeight})
        if (side < 1 || side > mostSide) refuse("has a side that is not 1 to 16384 pixels");
    if (std::abs(std::int64_t(header.data.x)) > 65536 || std::abs(std::int64_t(header.data.y)) > 65536)
        refuse("has a data window beyond +-65536");
    const auto count = get<std::uint32_t>(bytes, 52);
    if (count < 1 || count > mostPlanes) refuse("has not 1 to 64 planes");
    if (bytes.size() < filledUp(fixedBytes + count * nameBytes)) refuse("ends in its header");
    for (std::uint32_t p = 0; p < count; ++p) {
        const std::string_view name = bytes.substr(fixedBytes + p * nameBytes, nameBytes);
        header.planes.emplace_back(name.substr(0, name.find('\0')));
    }
    if (get<std::uint32_t>(bytes, 12) != header.headerBytes() || get<std::uint64_t>(bytes, 56) != header.planeBytes())
        refuse("has a header whose sizes contradict one another");
    if (bytes.size() != header.bytes()) refuse("has another number of bytes than its header says");
    return header;
}

ImageF readRaw(std::string_view bytes)
{
    const RawHeader header = parseRawHeader(bytes);
    ImageF image(header.frameWidth, header.frameHeight, 4);
    const Window seen = overlap(header.data, {0, 0, header.frameWidth, header.frameHeight});
    if (seen.isEmpty()) return image;
    constexpr std::string_view names[] = {"R", "G", "B", "A"};
    std::vector<float> row(std::size_t(header.data.width));
    for (int c = 0; c < 4; ++c) {
        const auto found = std::find(header.planes.begin(), header.planes.end(), names[c]);
        if (found == header.planes.end() && c < 3) refuse("lacks one of the planes R, G and B");
        const char* plane =
            bytes.data() + header.headerBytes() + std::size_t(found - header.planes.begin()) * header.planeBytes();
        for (int y = seen.y; y < seen.bottom(); ++y) {
            const std::size_t at = std::size_t(y - header.data.y) * row.size();
            if (found == header.planes.end()) {
                std::fill(row.begin(), row.end(), 1.0f);
            } else if (header.isFloat) {
                std::memcpy(row.data(), plane + 4 * at, 4 * row.size());
            } else {
                std::vector<std::uint16_t> halves(row.size());
                std::memcpy(halves.data(), plane + 2 * at, 2 * row.size());
                io::floatsFromHalves(halves.data(), row.data(), row.size());
            }
            for (int x = seen.x; x < seen.right(); ++x) image.at(x, y, c) = row[std::size_t(x - header.data.x)];
        }
    }
    return image;
}

}  // namespace virga::server
