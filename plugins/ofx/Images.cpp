#include "Images.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace virga::ofxplugin {

virga_window FrameInPlane::windowOf(const OfxRectI& plane) const
{
    return {plane.x1 - left, height - (plane.y2 - bottom), plane.x2 - plane.x1, plane.y2 - plane.y1};
}

OfxRectI FrameInPlane::planeOf(const virga_window& window) const
{
    const int top = bottom + height - window.y;
    return {left + window.x, top - window.height, left + window.x + window.width, top};
}

virga_window intersection(const virga_window& a, const virga_window& b)
{
    const int x = std::max(a.x, b.x), y = std::max(a.y, b.y);
    const int width = std::min(a.x + a.width, b.x + b.width) - x, height = std::min(a.y + a.height, b.y + b.height) - y;
    return width > 0 && height > 0 ? virga_window{x, y, width, height} : virga_window{x, y, 0, 0};
}

bool contains(const virga_window& outer, const virga_window& inner)
{
    return outer.x <= inner.x && outer.y <= inner.y && outer.x + outer.width >= inner.x + inner.width &&
           outer.y + outer.height >= inner.y + inner.height;
}

Clip::Clip(OfxImageEffectHandle effect, const char* name)
{
    OfxPropertySetHandle set = nullptr;
    if (host().effect().clipGetHandle(effect, name, &clip_, &set) != ofx::statOk || clip_ == nullptr)
        throw Failure(ofx::statFailed, std::string("the host has no clip '") + name + "'");
    if (set == nullptr) host().effect().clipGetPropertySet(clip_, &set);
    properties_ = Properties(set);
}

std::optional<OfxRectD> Clip::regionOfDefinition(OfxTime time) const
{
    OfxRectD region{};
    if (host().effect().clipGetRegionOfDefinition(clip_, time, &region) != ofx::statOk) return std::nullopt;
    if (!(region.x2 > region.x1 && region.y2 > region.y1)) return std::nullopt;
    return region;
}

Image::Image(const Clip& clip, OfxTime time, const OfxRectD* region)
{
    OfxPropertySetHandle set = nullptr;
    const OfxStatus status = host().effect().clipGetImage(clip.handle(), time, region, &set);
    if (status == ofx::statErrMemory) throw std::bad_alloc();
    if (status == ofx::statErrBadHandle) throw Failure(ofx::statFailed, "the host has lost a clip");
    if (status != ofx::statOk || set == nullptr) return;
    image_ = Properties(set);
    try {
        const std::string depth = image_.text(ofx::prop::pixelDepth), components = image_.text(ofx::prop::components);
        if (depth == ofx::value::depthFloat)
            samples_ = VIRGA_FLOAT;
        else if (depth == ofx::value::depthHalf)
            samples_ = VIRGA_HALF;
        else if (depth == ofx::value::depthShort)
            samples_ = VIRGA_UINT16;
        else if (depth == ofx::value::depthByte)
            samples_ = VIRGA_UINT8;
        else
            throw Failure(ofx::statErrFormat,
                          "an image of pixel depth '" + depth + "': must be byte, short, half or float");
        if (components == ofx::value::componentRgba)
            layout_ = VIRGA_RGBA;
        else if (components == ofx::value::componentRgb)
            layout_ = VIRGA_RGB;
        else if (components == ofx::value::componentAlpha)
            layout_ = VIRGA_GREY;
        else
            throw Failure(ofx::statErrFormat,
                          "an image of components '" + components + "': must be RGBA, RGB or alpha");
        const auto bounds = image_.rectangle(ofx::prop::bounds);
        data_ = static_cast<std::byte*>(image_.pointer(ofx::prop::data));
        if (!bounds || data_ == nullptr) throw Failure(ofx::statFailed, "the host gave an image without pixels");
        bounds_ = *bounds;
        rowBytes_ = image_.whole(ofx::prop::rowBytes, int(pixelBytes()) * (bounds_.x2 - bounds_.x1));
        std::string alpha = image_.text(ofx::prop::preMultiplication);
        if (alpha.empty()) alpha = clip.properties().text(ofx::prop::preMultiplication);
        isStraight_ = alpha == ofx::value::unpremultiplied;
    } catch (...) {
        host().effect().clipReleaseImage(set);
        throw;
    }
}

Image::~Image()
{
    if (!isEmpty()) host().effect().clipReleaseImage(image_.handle());
}

std::size_t Image::pixelBytes() const
{
    const std::size_t channels = layout_ == VIRGA_RGBA ? 4 : layout_ == VIRGA_RGB ? 3 : 1;
    return channels * (samples_ == VIRGA_FLOAT ? 4 : samples_ == VIRGA_UINT8 ? 1 : 2);
}

std::byte* Image::pixel(int x, int y) const
{
    return data_ + std::ptrdiff_t(y - bounds_.y1) * rowBytes_ +
           std::ptrdiff_t(x - bounds_.x1) * std::ptrdiff_t(pixelBytes());
}

virga_picture Image::picture(const FrameInPlane& frame) const
{
    virga_picture picture = virga_picture_default();
    picture.layout = layout_;
    picture.samples = samples_;
    picture.is_straight = isStraight_;
    picture.window = frame.windowOf(bounds_);
    if (picture.window.width < 1 || picture.window.height < 1) return picture;
    picture.planes[0] = pixel(bounds_.x1, bounds_.y2 - 1);
    picture.row_stride[0] = -rowBytes_;
    return picture;
}

FilledPicture::FilledPicture(const Image& image, const FrameInPlane& frame, const virga_window& window)
    : pixelBytes_(image.isEmpty() ? 16 : image.pixelBytes()), picture_(virga_picture_default())
{
    const std::size_t row = pixelBytes_ * std::size_t(window.width);
    pixels_.resize(row * std::size_t(window.height));
    if (!image.isEmpty()) {
        const virga_picture from = image.picture(frame);
        picture_ = from;
        const virga_window common = intersection(from.window, window);
        for (int y = common.y; y < common.y + common.height; ++y) {
            const auto* source = static_cast<const std::byte*>(from.planes[0]) +
                                 std::ptrdiff_t(y - from.window.y) * from.row_stride[0] +
                                 std::ptrdiff_t(common.x - from.window.x) * std::ptrdiff_t(pixelBytes_);
            std::memcpy(
                pixels_.data() + row * std::size_t(y - window.y) + pixelBytes_ * std::size_t(common.x - window.x),
                source, pixelBytes_ * std::size_t(common.width));
        }
    }
    picture_.window = window;
    picture_.planes[0] = pixels_.data();
    picture_.row_stride[0] = std::ptrdiff_t(row);
}

void FilledPicture::stretch(int width, int height)
{
    std::vector<std::byte> larger(pixelBytes_ * std::size_t(width) * std::size_t(height));
    const virga_window& from = picture_.window;
    std::byte* to = larger.data();
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x, to += pixelBytes_) {
            const std::size_t sourceX = std::size_t(std::int64_t(x) * from.width / width);
            const std::size_t sourceY = std::size_t(std::int64_t(y) * from.height / height);
            std::memcpy(to, pixels_.data() + pixelBytes_ * (sourceY * std::size_t(from.width) + sourceX), pixelBytes_);
        }
    pixels_ = std::move(larger);
    picture_.window = {0, 0, width, height};
    picture_.planes[0] = pixels_.data();
    picture_.row_stride[0] = std::ptrdiff_t(pixelBytes_) * width;
}

}  // namespace virga::ofxplugin
