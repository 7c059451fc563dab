// Which encoder writes a movie, and which pixel format it takes: from the output's container, the plate, and what the
// user asks for.
#pragma once

#include <string>

#include "io/FrameSource.h"
#include "io/Libav.h"

struct AVCodec;
struct AVOutputFormat;

namespace virga::io {

/// Throws Error(InvalidArgument) for an encoder that is not known or does not fit the container, Error(Output) if there
/// is none for the container.
const AVCodec* chooseEncoder(const std::string& path, const AVOutputFormat& container, const PlateInfo& plate,
                             const MovieOrigin* origin, const WriteOptions& options);

/// The encoder's format that is nearest to the plate's, AV_PIX_FMT_*; the one asked for if one is, and within what a
/// profile that is asked for can hold. Says what is lost. Throws Error(InvalidArgument) for a format that is not known
/// or that the encoder does not take.
int choosePixelFormat(const std::string& path, const AVOutputFormat& container, const AVCodec& encoder,
                      const PlateInfo& plate, const MovieOrigin* origin, const WriteOptions& options);

/// A profile of a codec: its name for the user, FFmpeg's number, and the most that its pictures can hold.
struct CodecProfile {
    const char* encoder;
    const char* name;
    int number;
    int bits, chromaShiftX, chromaShiftY;
    bool hasAlpha;
};
/// Throws Error(InvalidArgument) for a profile that the encoder does not have.
const CodecProfile& findProfile(const AVCodec& encoder, const std::string& name);

bool isEncoder(const AVCodec& encoder, const char* name);

}  // namespace virga::io
