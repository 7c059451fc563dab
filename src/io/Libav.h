// FFmpeg's objects with an owner, and its names for pixel formats and colour tags in our words.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "io/ColorConversion.h"
#include "io/FrameSource.h"
#include "io/Yuv.h"

struct AVFormatContext;
struct AVCodecContext;
struct AVFrame;
struct AVPacket;

namespace virga::io::libav {

struct CloseInput {
    void operator()(AVFormatContext*) const noexcept;
};
struct CloseOutput {
    void operator()(AVFormatContext*) const noexcept;
};
struct FreeCodec {
    void operator()(AVCodecContext*) const noexcept;
};
struct FreeFrame {
    void operator()(AVFrame*) const noexcept;
};
struct FreePacket {
    void operator()(AVPacket*) const noexcept;
};
using Input = std::unique_ptr<AVFormatContext, CloseInput>;
using Output = std::unique_ptr<AVFormatContext, CloseOutput>;
using Codec = std::unique_ptr<AVCodecContext, FreeCodec>;
using Frame = std::unique_ptr<AVFrame, FreeFrame>;
using Packet = std::unique_ptr<AVPacket, FreePacket>;

Frame makeFrame();
Packet makePacket();

/// FFmpeg's words for an error number.
std::string errorText(int error);
/// A path as FFmpeg's functions want it: what stands before a colon ("take:2.mp4") would be a protocol.
std::string urlOf(const std::string& path);
/// Once a process: FFmpeg's own messages go to the detailed log, and those of a decoder with Complaints there too.
void routeMessages();

/// What a decoder says of the packets that it is given, which is more than it returns: of HEVC, a picture's hash that
/// does not fit (ITU-T H.265, D.3.19), a reference that is missing, slices that end before the picture does. It talks
/// through routeMessages. AVCodecContext::opaque points to this, and its reordered_opaque is set to a packet's time
/// before the packet is sent. Any thread may call.
class Complaints {
public:
    void add(std::int64_t packetTime);
    /// The last block of the packet's picture has been decoded.
    void addWhole(std::int64_t packetTime);
    /// Before the packet is sent again.
    void forget(std::int64_t packetTime);
    /// Whether it was found fault with, or is not whole, as far as this decoder says so of any.
    bool has(std::int64_t packetTime) const;

private:
    mutable std::mutex mutex_;
    std::set<std::int64_t> wrong_, whole_;
    bool saysWhole_ = false;
};

/// The samples that a pixel format has, whatever their layout in memory; nothing for formats that are not supported
/// (float, Bayer, XYZ, bits packed into bytes, hardware).
std::optional<PlanarFormat> samplesOf(int pixelFormat);
/// Whether they lie in memory as PlanarFormat says, so that nothing need be repacked.
bool isPlanar(int pixelFormat);
/// FFmpeg's planar format with these samples; AV_PIX_FMT_NONE if it has none.
int pixelFormatOf(const PlanarFormat& format);
/// Whether the format is one of the old full-range names (yuvj420p), and the format without the range in its name.
bool isFullRangeName(int pixelFormat);
int withoutRangeName(int pixelFormat);
const char* pixelFormatName(int pixelFormat);

/// A planar picture with its own memory, for formats that FFmpeg keeps in another layout.
class PlanarBuffer {
public:
    PlanarBuffer(const PlanarFormat& format, int width, int height);
    PlanarPicture picture();

private:
    PlanarFormat format_;
    int width_, height_;
    std::array<std::vector<std::uint8_t>, 4> planes_;
};

/// The samples of a frame into planes and back, value for value. Samples of fewer than 8 bits are scaled to 8.
void unpack(const AVFrame& frame, const PlanarFormat& format, const PlanarPicture& planes);
void pack(const ConstPlanarPicture& planes, const PlanarFormat& format, AVFrame& frame);
/// The same memory, not to be written to.
ConstPlanarPicture asConst(const PlanarPicture& picture);
/// The planes of a frame whose format isPlanar().
PlanarPicture planesOf(const AVFrame& frame);

/// AVCOL_SPC_* that a movie of this size has if it does not say: 601 for standard definition, else 709.
int guessedMatrix(int width, int height);
/// Throws Error(Input) naming `path` for matrices that are not linear in R'G'B' or not known (ICtCp, constant
/// luminance).
YuvCoding yuvCoding(int matrix, bool fullRange, const std::string& path);

/// Where chroma is taken (AVCHROMA_LOC_*, ITU-T H.273 figure 1). What nobody says is "left", as in MPEG-2, H.264 and
/// HEVC.
ChromaFilter chromaSites(int location);

/// The colour space of ours with this transfer and these primaries (AVCOL_TRC_*, AVCOL_PRI_*, AVCOL_SPC_*), and the
/// tags that say so; a guess if there are none. What is missing or not supported is taken for the curve of
/// display-referred video and for Rec.709; the BT.2020 matrix stands for its primaries.
ColorClaim colorClaimOf(int transfer, int primaries, int matrix);
/// The tags that say so; all "unspecified" for null and for data.
struct ColorTags {
    int transfer, primaries, matrix;
};
ColorTags tagsOf(const NamedSpace* space);

}  // namespace virga::io::libav
