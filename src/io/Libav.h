// FFmpeg's objects with an owner, and its names for pixel formats and colour tags in our words.
#pragma once

#include <memory>
#include <string>

#include "io/FrameSource.h"
#include "io/Yuv.h"

struct AVFormatContext;
struct AVCodecContext;
struct AVFrame;
struct AVPacket;
struct SwsContext;

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
struct FreeScaler {
    void operator()(SwsContext*) const noexcept;
};
using Input = std::unique_ptr<AVFormatContext, CloseInput>;
using Output = std::unique_ptr<AVFormatContext, CloseOutput>;
using Codec = std::unique_ptr<AVCodecContext, FreeCodec>;
using Frame = std::unique_ptr<AVFrame, FreeFrame>;
using Packet = std::unique_ptr<AVPacket, FreePacket>;
using Scaler = std::unique_ptr<SwsContext, FreeScaler>;

Frame makeFrame();
Packet makePacket();

/// FFmpeg's words for an error number.
std::string errorText(int error);
/// Once a process: FFmpeg's own messages go to the detailed log.
void routeMessages();

/// The planar format with the same samples, or nothing if only a repacking (see planarEquivalent) leads to one.
std::optional<PlanarFormat> planarFormat(int pixelFormat);
/// FFmpeg's format with these samples; AV_PIX_FMT_NONE if it has none.
int pixelFormatOf(const PlanarFormat& format);
/// The format that libswscale should repack to so that planarFormat() knows it and no bit is lost; AV_PIX_FMT_NONE for
/// formats that are not supported (float, Bayer, XYZ, hardware).
int planarEquivalent(int pixelFormat);
/// Whether the format is one of the old full-range names (yuvj420p), and the format without the range in its name.
bool isFullRangeName(int pixelFormat);
int withoutRangeName(int pixelFormat);
const char* pixelFormatName(int pixelFormat);

/// AVCOL_SPC_* that a movie of this size has if it does not say: 601 for standard definition, else 709.
int guessedMatrix(int width, int height);
/// Throws Error(Input) naming `path` for matrices that are not weights of R'G'B' (YCgCo, ICtCp, constant luminance).
YuvCoding yuvCoding(int matrix, bool fullRange, const std::string& path);

/// The colour space of ours with this transfer and these primaries (AVCOL_TRC_*, AVCOL_PRI_*).
std::string colorspaceOf(int transfer, int primaries);
/// The tags that say so, for a space of ours; all "unspecified" for others.
struct ColorTags {
    int transfer, primaries, matrix;
};
ColorTags tagsOf(const std::string& colorspace);

}  // namespace virga::io::libav
