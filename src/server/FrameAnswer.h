// A rendered frame on its way to a client: as an image file, as raw planes, in shared memory.
#pragma once

#include <memory>
#include <string>

#include "io/Plate.h"
#include "server/FrameQuery.h"
#include "server/RawFrame.h"
#include "server/SharedMemory.h"

namespace virga::server {

/// What was rendered, kept for whoever asks for it in whatever format.
struct Picture {
    io::RenderedFrame frame;
    Window data;                          ///< which pixels of the frame at its scale `frame` has
    int frameWidth = 0, frameHeight = 0;  ///< of the whole frame at its scale
    bool isWhole() const { return data == Window{0, 0, frameWidth, frameHeight}; }
    std::size_t bytes() const;
};

/// The bytes of an EXR, PNG or JPEG file: the one that `virga rain -o` writes of that frame, where the picture is whole
/// and at full scale. PNG and JPEG show one layer. Throws Refusal 400 for what the format has no place for,
/// Error(InvalidArgument) for a colour space that nobody knows, Error(Output).
std::string encodeImage(const Picture& picture, const io::PlateInfo& plate, const shot::Settings& settings,
                        const FrameQuery& query, Format format);

/// The planes asked for. Without a colour space they are scene-linear light in the plate's working space.
std::string encodeRaw(const Picture& picture, const io::PlateInfo& plate, const FrameQuery& query);
/// The same, written straight into shared memory.
std::unique_ptr<SharedBlock> encodeShared(const Picture& picture, const io::PlateInfo& plate, const FrameQuery& query);

}  // namespace virga::server
