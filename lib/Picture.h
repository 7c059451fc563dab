// A caller's picture, checked: every window, plane and stride of it may be relied on.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>

#include "core/PlanarPicture.h"
#include "core/Window.h"
#include "virga/virga.h"

namespace virga::lib {

constexpr int mostPixels = 16384;  ///< a side: what OpenGL 4.5 promises for textures

/// Throws Error(InvalidArgument) unless `scale` is 0, which stands for 1, or in (0, 1].
double checkedScale(double scale);

/// The caller's struct as this library knows it: what an older caller has not is zero. Throws Error(InvalidArgument)
/// for a size that no version had, and for what a newer caller set and this library does not know.
virga_picture known(const virga_picture* given, const std::string& name);
virga_request known(const virga_request* given);

class Picture {
public:
    /// window: what stands for one of no width and height. Throws Error(InvalidArgument) naming `name`.
    Picture(const virga_picture* given, const std::string& name, const Window& window);
    /// The same of a picture that must say how large it is.
    static Picture ofItsOwnSize(const virga_picture* given, const std::string& name);

    const std::string& name() const { return name_; }
    const Window& window() const { return window_; }
    const std::string& colorspace() const { return colorspace_; }  ///< empty: scene-linear
    virga_layout layout() const { return p_.layout; }
    virga_samples samples() const { return p_.samples; }
    bool isInteger() const { return p_.samples == VIRGA_UINT8 || p_.samples == VIRGA_UINT16; }
    bool isYuv() const { return p_.layout >= VIRGA_YUV420; }
    bool hasAlpha() const;
    bool isStraight() const { return hasAlpha() && (p_.is_straight != 0 || isYuv()); }
    int bits() const;           ///< of integers
    float largestCode() const;  ///< of integers
    std::size_t sampleBytes() const;

    /// Of interleaved, grey and planar layouts alike: where a channel of a pixel of the window lies. Channels: R G B A,
    /// Y Cb Cr A (pixels that share chroma: of the sample that they share).
    struct Channel {
        std::byte* top = nullptr;  ///< of the window's first pixel
        std::ptrdiff_t row = 0, pixel = 0;
        int shiftX = 0, shiftY = 0;
        std::byte* at(int x, int y) const { return top + (y >> shiftY) * row + (x >> shiftX) * pixel; }
    };
    int channels() const { return channelCount_; }
    const Channel& channel(int index) const { return channels_[std::size_t(index)]; }

    /// Of YUV.
    PlanarFormat planarFormat() const;
    YuvCoding coding() const;
    ChromaFilter chromaSiting() const;
    /// The part of a window whose first pixel is at (x, y) of the picture's; a multiple of the pixels that share
    /// chroma.
    PlanarPicture planar(int x, int y, int width, int height) const;
    int chromaShiftX() const;
    int chromaShiftY() const;

    /// Whether the same pixels have the same bytes in both.
    bool isLike(const Picture& other) const;

private:
    void checkWords() const;
    void checkWindow() const;
    void placeChannels();

    virga_picture p_;
    std::string name_, colorspace_;
    Window window_;
    int channelCount_ = 0;
    std::array<Channel, 4> channels_{};
};

}  // namespace virga::lib
