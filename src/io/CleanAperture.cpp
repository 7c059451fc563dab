#include "io/CleanAperture.h"

extern "C" {
#include <libavformat/avformat.h>
}

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>

namespace virga::io {

namespace {

constexpr int mostParts = 100000;  // boxes or elements looked at, in a file that is made to be endless

/// A file of big-endian numbers; reading past the end gives zeros and isGood() false from then on.
class Bytes {
public:
    explicit Bytes(const std::string& path) : file_(path, std::ios::binary)
    {
        file_.seekg(0, std::ios::end);
        size_ = file_ ? std::uint64_t(file_.tellg()) : 0;
    }
    std::uint64_t size() const { return size_; }
    bool isGood() const { return bool(file_); }
    void goTo(std::uint64_t place) { file_.seekg(std::streamoff(place)); }
    std::uint64_t place() { return file_ ? std::uint64_t(file_.tellg()) : size_; }
    std::uint64_t number(int bytes)
    {
        std::uint64_t value = 0;
        for (int i = 0; i < bytes; ++i) {
            const int byte = file_.get();
            value = value << 8 | std::uint64_t(file_ ? byte : 0);
        }
        return value;
    }

private:
    std::ifstream file_;
    std::uint64_t size_ = 0;
};

struct Part {
    std::uint64_t id = 0, begin = 0, end = 0;  // of its content
};

constexpr std::uint64_t box(const char (&name)[5])
{
    std::uint64_t id = 0;
    for (int i = 0; i < 4; ++i) id = id << 8 | std::uint8_t(name[i]);
    return id;
}

/// The box at the current place, which ends at `end` at the latest.
std::optional<Part> readBox(Bytes& bytes, std::uint64_t end)
{
    const std::uint64_t start = bytes.place();
    std::uint64_t size = bytes.number(4);
    const std::uint64_t id = bytes.number(4);
    if (size == 1) size = bytes.number(8);
    if (size == 0) size = end - start;
    const std::uint64_t begin = bytes.place();
    if (!bytes.isGood() || size > end - start || start + size < begin) return std::nullopt;
    return Part{id, begin, start + size};
}

/// RFC 8794, 4: as many leading zeros as bytes follow. keepMark: as identifiers are written.
std::uint64_t readVint(Bytes& bytes, bool keepMark, bool& isUnknown)
{
    const auto first = unsigned(bytes.number(1));
    int more = 0;
    while (more < 8 && (first & (0x80u >> more)) == 0) ++more;
    isUnknown = false;
    if (more == 8) return 0;
    const unsigned mark = 0x80u >> more;
    const std::uint64_t value = std::uint64_t(keepMark ? first : first & (mark - 1)) << (8 * more) | bytes.number(more);
    isUnknown = !keepMark && value == (std::uint64_t(1) << (7 * (more + 1))) - 1;
    return value;
}

std::optional<Part> readElement(Bytes& bytes, std::uint64_t end)
{
    bool isUnknown = false;
    const std::uint64_t id = readVint(bytes, true, isUnknown);
    const std::uint64_t size = readVint(bytes, false, isUnknown);
    const std::uint64_t begin = bytes.place();
    if (!bytes.isGood() || id == 0 || begin > end) return std::nullopt;
    if (isUnknown) return Part{id, begin, end};
    if (size > end - begin) return std::nullopt;
    return Part{id, begin, begin + size};
}

using ReadPart = std::optional<Part> (*)(Bytes&, std::uint64_t);

/// Calls visit(part) for each part in `within` until it says true.
template <class Visit>
bool visitParts(Bytes& bytes, ReadPart read, const Part& within, int& budget, const Visit& visit)
{
    for (std::uint64_t place = within.begin; place < within.end && --budget > 0;) {
        bytes.goTo(place);
        const auto part = read(bytes, within.end);
        if (!part) return false;
        if (visit(*part)) return true;
        place = part->end;
    }
    return false;
}

std::optional<CleanAperture> ofIsoMedia(Bytes& bytes, int track, int codedWidth, int codedHeight)
{
    int budget = mostParts;
    std::optional<CleanAperture> found;
    const auto inside = [&](const Part& part, const auto& visit) {
        return visitParts(bytes, readBox, part, budget, visit);
    };
    const auto only = [&](const Part& part, std::uint64_t id, const auto& next) {
        inside(part, [&](const Part& child) {
            if (child.id != id) return false;
            next(child);
            return true;
        });
    };
    const auto readClap = [&](const Part& clap) {
        bytes.goTo(clap.begin);
        std::array<double, 4> ratios{};  // width, height, and the middle's distance from the picture's
        for (double& ratio : ratios) {
            const auto over = std::int32_t(bytes.number(4)), under = std::int32_t(bytes.number(4));
            if (under == 0) return;
            ratio = double(over) / under;
        }
        if (bytes.isGood())
            found = {(codedWidth - ratios[0]) / 2 + ratios[2], (codedHeight - ratios[1]) / 2 + ratios[3], ratios[0],
                     ratios[1]};
    };
    const auto readTrack = [&](const Part& trak) {
        bool isIt = false;
        only(trak, box("tkhd"), [&](const Part& header) {
            bytes.goTo(header.begin);
            const bool isLong = bytes.number(1) == 1;
            bytes.goTo(header.begin + (isLong ? 20 : 12));
            isIt = bytes.number(4) == std::uint64_t(track);
        });
        if (!isIt) return false;
        only(trak, box("mdia"), [&](const Part& mdia) {
            only(mdia, box("minf"), [&](const Part& minf) {
                only(minf, box("stbl"), [&](const Part& stbl) {
                    only(stbl, box("stsd"), [&](const Part& stsd) {
                        constexpr std::uint64_t beforeEntries = 8, visualFields = 78;
                        const Part entries{0, stsd.begin + beforeEntries, stsd.end};
                        inside(entries, [&](const Part& entry) {
                            only({0, entry.begin + visualFields, entry.end}, box("clap"), readClap);
                            return true;
                        });
                    });
                });
            });
        });
        return true;
    };
    only({0, 0, bytes.size()}, box("moov"), [&](const Part& moov) {
        inside(moov, [&](const Part& part) { return part.id == box("trak") && readTrack(part); });
    });
    return found;
}

/// FFmpeg's streams come in the order of the tracks.
std::optional<CleanAperture> ofMatroska(Bytes& bytes, int index, int codedWidth, int codedHeight)
{
    constexpr std::uint64_t segment = 0x18538067, cluster = 0x1F43B675, tracks = 0x1654AE6B, entry = 0xAE, video = 0xE0,
                            cropBottom = 0x54AA, cropTop = 0x54BB, cropLeft = 0x54CC, cropRight = 0x54DD;
    int budget = mostParts;
    std::optional<CleanAperture> found;
    const auto inside = [&](const Part& part, const auto& visit) {
        return visitParts(bytes, readElement, part, budget, visit);
    };
    const auto value = [&](const Part& part) {
        bytes.goTo(part.begin);
        return bytes.number(int(std::min<std::uint64_t>(part.end - part.begin, 8)));
    };
    const auto readEntry = [&](const Part& part) {
        double left = 0, right = 0, top = 0, bottom = 0;
        inside(part, [&](const Part& child) {
            if (child.id == video)
                inside(child, [&](const Part& field) {
                    if (field.id == cropLeft) left = double(value(field));
                    if (field.id == cropRight) right = double(value(field));
                    if (field.id == cropTop) top = double(value(field));
                    if (field.id == cropBottom) bottom = double(value(field));
                    return false;
                });
            return false;
        });
        found = {left, top, codedWidth - left - right, codedHeight - top - bottom};
    };
    inside({0, 0, bytes.size()}, [&](const Part& part) {
        return part.id == segment && inside(part, [&](const Part& child) {
                   if (child.id == tracks)
                       inside(child, [&](const Part& track_) {
                           if (track_.id != entry || index-- > 0) return false;
                           readEntry(track_);
                           return true;
                       });
                   return child.id == tracks || child.id == cluster;
               });
    });
    return found;
}

}  // namespace

std::optional<CleanAperture> cleanApertureOf(const std::string& path, const std::string& demuxer,
                                             const AVStream& stream, int codedWidth, int codedHeight) noexcept
try {
    const bool isIso = demuxer.starts_with("mov,"), isMatroska = demuxer.starts_with("matroska,");
    if (!isIso && !isMatroska) return std::nullopt;
    Bytes bytes(path);
    const auto found = isIso ? ofIsoMedia(bytes, stream.id, codedWidth, codedHeight)
                             : ofMatroska(bytes, stream.index, codedWidth, codedHeight);
    constexpr double same = 1e-3;
    if (!found || found->width <= 0 || found->height <= 0 || found->left < -same || found->top < -same ||
        found->left + found->width > codedWidth + same || found->top + found->height > codedHeight + same)
        return std::nullopt;
    const bool isAll = std::fabs(found->width - codedWidth) < same && std::fabs(found->height - codedHeight) < same;
    return isAll ? std::nullopt : found;
} catch (...) {
    return std::nullopt;
}

}  // namespace virga::io
