// Planes of codes to the device and back: a frame travels as the decoder and the encoder have it, a tenth of its float
// picture, and becomes light on the device. Buffers stay mapped and several frames are on their way, so that a copy,
// the passes and the next copy go on at once.
//
// Within half a code of io/Yuv.h for up to 12 bits (tests/passes/planes_test.cpp); a device's powers are good to about
// 1e-6, which is too coarse for 16.
#pragma once

#include <array>
#include <string>

#include "core/PlanarPicture.h"
#include "gl/Transfer.h"
#include "passes/FrameTargets.h"

namespace virga::passes {

/// Frames that may be on their way at once.
constexpr std::size_t transfersInFlight = 3;

/// Whether codes of this format may be converted on the device.
bool convertsOnDevice(const PlanarFormat& format);

/// Codes to FrameTargets::plate.
class PlanesIn {
public:
    /// For pictures like this one: its size, format, meaning. shaderFolder: see gl::loadShader. Throws Error(Graphics).
    explicit PlanesIn(const ConstCodedPlanes& like, const std::string& shaderFolder = {});

    /// Whether `picture` is like the first.
    bool fits(const ConstCodedPlanes& picture) const;
    /// Copies the codes, waiting only if transfersInFlight earlier pictures are not done with, and has the device
    /// convert them. Before FrameTargets::bind.
    void run(const ConstCodedPlanes& picture, const FrameTargets& targets);

private:
    struct Slot {
        gl::MappedBuffer codes;
        gl::Fence used;
    };
    ConstCodedPlanes like_;
    gl::Program program_;
    gl::Buffer layout_, codes_;
    std::array<Slot, transfersInFlight> slots_;
    std::size_t next_ = 0;
};

/// The beauty to codes. Frames come back in the order in which they were run.
class PlanesOut {
public:
    explicit PlanesOut(const CodedPlanes& like, const std::string& shaderFolder = {});

    bool fits(const CodedPlanes& picture) const;
    /// Has the device convert the beauty that the composite left; at most transfersInFlight frames before finish().
    void run(const FrameTargets& targets);
    /// Waits for the oldest frame that was run, and puts its codes into `picture`.
    void finish(const CodedPlanes& picture);

private:
    struct Slot {
        gl::MappedBuffer codes;
        gl::Fence done;
    };
    CodedPlanes like_;
    gl::Program program_;
    gl::Buffer layout_, codes_;
    std::array<Slot, transfersInFlight> slots_;
    std::size_t next_ = 0, oldest_ = 0;
};

}  // namespace virga::passes
