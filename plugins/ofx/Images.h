// Clips and images of the host's, and what they are in Virga's words.
//
// OpenFX counts rows upwards and lays images anywhere in a plane of pixels; Virga counts them downwards within a frame
// (docs/conventions.md). FrameInPlane is where the frame lies, at the scale that is rendered at.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "Host.h"
#include "virga/virga.h"

namespace virga::ofxplugin {

/// A frame of width x height pixels whose lower left pixel is (left, bottom) of the host's plane.
struct FrameInPlane {
    int left = 0, bottom = 0, width = 0, height = 0;

    /// Pixels of the plane, in the frame; may reach beyond it.
    virga_window windowOf(const OfxRectI& plane) const;
    OfxRectI planeOf(const virga_window& window) const;
};

virga_window intersection(const virga_window& a, const virga_window& b);
bool contains(const virga_window& outer, const virga_window& inner);

/// An input or output of an instance.
class Clip {
public:
    /// Throws Failure if the host does not know it.
    Clip(OfxImageEffectHandle effect, const char* name);

    const Properties& properties() const { return properties_; }
    bool isConnected() const { return properties_.whole(ofx::prop::connected, 0) != 0; }
    /// In canonical units; nothing if it has no image at that time.
    std::optional<OfxRectD> regionOfDefinition(OfxTime time) const;
    OfxImageClipHandle handle() const { return clip_; }

private:
    OfxImageClipHandle clip_ = nullptr;
    Properties properties_{nullptr};
};

/// An image, held until the end of the scope.
class Image {
public:
    /// region: in canonical units, what it must have at least; null: what the host thinks fit.
    /// isEmpty() if there is none: it counts as black and transparent. Throws Failure for memory and bad handles, for
    /// components or depths that were never asked for, and for an image without pixels.
    Image(const Clip& clip, OfxTime time, const OfxRectD* region);
    ~Image();
    Image(const Image&) = delete;
    Image& operator=(const Image&) = delete;

    bool isEmpty() const { return image_.handle() == nullptr; }
    const OfxRectI& bounds() const { return bounds_; }
    virga_layout layout() const { return layout_; }
    virga_samples samples() const { return samples_; }
    std::size_t pixelBytes() const;
    std::string identifier() const { return image_.text(ofx::prop::uniqueIdentifier); }
    /// The lower left pixel of pixel (x, y) of the plane.
    std::byte* pixel(int x, int y) const;

    /// All of it, top row first; what lies outside the frame is overscan. No colour space is said.
    virga_picture picture(const FrameInPlane& frame) const;

private:
    Properties image_{nullptr};
    OfxRectI bounds_{};
    std::byte* data_ = nullptr;
    std::ptrdiff_t rowBytes_ = 0;
    virga_layout layout_ = VIRGA_RGBA;
    virga_samples samples_ = VIRGA_FLOAT;
    bool isStraight_ = false;
};

/// A picture like `image` of exactly `window`, with transparent black where the image has nothing.
class FilledPicture {
public:
    FilledPicture(const Image& image, const FrameInPlane& frame, const virga_window& window);
    FilledPicture(FilledPicture&&) = default;
    const virga_picture& picture() const { return picture_; }
    /// Repeats pixels so that it is width x height, its window at (0, 0).
    void stretch(int width, int height);

private:
    std::size_t pixelBytes_;
    std::vector<std::byte> pixels_;
    virga_picture picture_;
};

}  // namespace virga::ofxplugin
