// application/x-virga-raw: a frame as planes of half or float behind a header of fixed layout, for whoever wants
// samples and no file format. docs/server.md, "Raw frames".
//
//   byte  0  "VIRGARAW"
//         8  u32 version, 1
//        12  u32 bytes of the header, from which on the planes come
//        16  i32 x, y, width, height of the pixels that are there, in the frame at its scale
//        32  i32 width, height of the whole frame at that scale
//        40  i64 number of the frame
//        48  u32 bytes of a sample: 2 (half), 4 (float)
//        52  u32 planes
//        56  u64 bytes from one plane to the next: its own, filled up to a multiple of 64
//        64  for each plane 32 bytes: its name, "R" or "rain.A", filled up with zeros
//
// Little-endian; rows from the top, packed. The header's bytes are a multiple of 64, so that planes lie well for SIMD.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/FrameRange.h"
#include "core/Image.h"
#include "core/Window.h"

namespace virga::server {

struct RawHeader {
    Window data;
    int frameWidth = 0, frameHeight = 0;
    FrameNumber frame = 0;
    bool isFloat = false;
    std::vector<std::string> planes;

    std::size_t headerBytes() const;
    std::size_t planeBytes() const;
    std::size_t bytes() const { return headerBytes() + planes.size() * planeBytes(); }
};

/// One plane's pixels: channel `channel` of an image of the header's data window.
struct RawPlane {
    ConstImageViewF pixels;
    int channel = 0;
};

/// Header and planes to `to`, which has header.bytes(). Floats too large for half become +-65504.
void writeRaw(const RawHeader& header, std::span<const RawPlane> planes, std::byte* to);

/// The header of a frame that somebody sent. Throws Refusal 400 if it is none, if it promises other than `bytes` bytes
/// in all, or sides over 16384 pixels.
RawHeader parseRawHeader(std::string_view bytes);

/// The planes R, G, B and, if there is one, A of a frame that somebody sent, placed in the whole frame; what lies
/// outside its data window is 0, and alpha without a plane is 1 inside it. Throws Refusal 400.
ImageF readRaw(std::string_view bytes);

}  // namespace virga::server
