#include "Picture.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "Errors.h"
#include "core/Error.h"

namespace virga::lib {
namespace {

constexpr std::size_t leastBytes = 16;  // of a struct in which there is anything

template <class Struct>
Struct knownStruct(const Struct* given, const std::string& name)
{
    needs(given, name.c_str());
    const std::size_t size = given->struct_size;
    if (size < leastBytes || size > 16 * sizeof(Struct))
        throw Error(ErrorCode::InvalidArgument, "{}: struct_size is {}; must be sizeof(the struct), here {}", name,
                    size, sizeof(Struct));
    Struct mine{};
    std::memcpy(&mine, given, std::min(size, sizeof mine));
    const auto* bytes = reinterpret_cast<const std::byte*>(given);
    const bool setsMore = size > sizeof mine &&
                          std::any_of(bytes + sizeof mine, bytes + size, [](std::byte b) { return b != std::byte(); });
    if (setsMore)
        throw Error(ErrorCode::InvalidArgument,
                    "{}: sets fields that a later version of the library has, and not this one", name);
    return mine;
}

void refuse(const std::string& name, const char* field, long long value, const char* allowed)
{
    throw Error(ErrorCode::InvalidArgument, "{}: {} is {}; must be {}", name, field, value, allowed);
}

int planesOf(virga_layout layout) { return layout == VIRGA_RGBA_PLANES ? 4 : layout >= VIRGA_YUV420 ? 4 : 1; }

/// Channels side by side in an interleaved layout.
int interleavedOf(virga_layout layout)
{
    return layout == VIRGA_RGBA || layout == VIRGA_BGRA ? 4 : layout == VIRGA_RGB ? 3 : 1;
}

}  // namespace

double checkedScale(double scale)
{
    if (scale == 0) return 1;
    if (!(scale > 0 && scale <= 1))
        throw Error(ErrorCode::InvalidArgument, "scale {}: must be over 0 and at most 1", scale);
    return scale;
}

virga_picture known(const virga_picture* given, const std::string& name) { return knownStruct(given, name); }
virga_request known(const virga_request* given) { return knownStruct(given, "request"); }

Picture::Picture(const virga_picture* given, const std::string& name, const Window& window)
    : p_(known(given, name)), name_(name),
      colorspace_(p_.color_space != nullptr ? p_.color_space : ""), window_{p_.window.x, p_.window.y, p_.window.width,
                                                                            p_.window.height}
{
    if (window_.width == 0 && window_.height == 0) window_ = window;
    checkWords();
    checkWindow();
    placeChannels();
}

Picture Picture::ofItsOwnSize(const virga_picture* given, const std::string& name)
{
    const virga_picture p = known(given, name);
    if (p.window.width < 1 || p.window.height < 1)
        throw Error(ErrorCode::InvalidArgument, "{}: {} x {} pixels; its window must say how large it is", name,
                    p.window.width, p.window.height);
    return {given, name, {}};
}

void Picture::checkWords() const
{
    const auto isAmong = [&](const auto& word, int last, const char* field, const char* allowed) {
        const int number = numberIn(word);
        if (number < 0 || number > last) refuse(name_, field, number, allowed);
    };
    isAmong(p_.layout, VIRGA_YUV444, "layout", "one of virga_layout");
    isAmong(p_.samples, VIRGA_UINT16, "samples", "one of virga_samples");
    if (isYuv() && !isInteger()) refuse(name_, "samples", int(p_.samples), "VIRGA_UINT8 or VIRGA_UINT16 for YUV");
    const int bits = p_.significant_bits;
    if (bits != 0 && !isInteger()) refuse(name_, "significant_bits", bits, "0 for half and float");
    if (bits != 0 && p_.samples == VIRGA_UINT8 && bits != 8) refuse(name_, "significant_bits", bits, "0 or 8");
    if (bits != 0 && p_.samples == VIRGA_UINT16 && (bits < 9 || bits > 16))
        refuse(name_, "significant_bits", bits, "0 or 9 to 16");
    if (!isYuv()) return;
    isAmong(p_.matrix, VIRGA_BT2020, "matrix", "one of virga_matrix");
    isAmong(p_.siting, VIRGA_SITING_TOP_LEFT, "siting", "one of virga_siting");
}

void Picture::checkWindow() const
{
    constexpr int farthest = 4 * mostPixels;
    if (window_.width < 1 || window_.height < 1 || window_.width > farthest || window_.height > farthest)
        throw Error(ErrorCode::InvalidArgument, "{}: a window of {} x {}: each side must be 1 to {} pixels", name_,
                    window_.width, window_.height, farthest);
    if (std::abs(std::int64_t(window_.x)) > farthest || std::abs(std::int64_t(window_.y)) > farthest)
        throw Error(ErrorCode::InvalidArgument, "{}: a window at ({}, {}): must be within {} pixels of the frame",
                    name_, window_.x, window_.y, farthest);
    const int across = 1 << chromaShiftX(), down = 1 << chromaShiftY();
    if (window_.x % across != 0 || window_.y % down != 0)
        throw Error(ErrorCode::InvalidArgument,
                    "{}: a window at ({}, {}): pixels share chroma, so x must be a multiple of {} and y of {}", name_,
                    window_.x, window_.y, across, down);
}

void Picture::placeChannels()
{
    const auto bytes = std::ptrdiff_t(sampleBytes());
    const int planes = planesOf(p_.layout);
    const std::ptrdiff_t pixel = planes > 1             ? bytes
                                 : p_.pixel_stride != 0 ? p_.pixel_stride
                                                        : bytes * interleavedOf(p_.layout);
    if (planes > 1 && p_.pixel_stride != 0 && p_.pixel_stride != bytes)
        refuse(name_, "pixel_stride", p_.pixel_stride, "0 where channels lie in planes");
    if (pixel < bytes * (planes > 1 ? 1 : interleavedOf(p_.layout)) || pixel % bytes != 0)
        refuse(name_, "pixel_stride", pixel, "at least a pixel's bytes, and a multiple of a sample's");
    for (int k = 0; k < planes; ++k) {
        auto* const top = static_cast<std::byte*>(p_.planes[k]);
        if (top == nullptr && k == 3) break;  // no alpha
        const std::string plane = planes > 1 ? name_ + ", plane " + std::to_string(k) : name_;
        needs(top, plane.c_str());
        Channel channel;
        const bool isChroma = isYuv() && (k == 1 || k == 2);
        if (isChroma) channel.shiftX = chromaShiftX(), channel.shiftY = chromaShiftY();
        const std::ptrdiff_t columns = (window_.width + (1 << channel.shiftX) - 1) >> channel.shiftX;
        const std::ptrdiff_t least = (columns - 1) * pixel + bytes * (planes > 1 ? 1 : interleavedOf(p_.layout));
        const std::ptrdiff_t row = p_.row_stride[k] != 0 ? p_.row_stride[k] : columns * pixel;
        if (row == PTRDIFF_MIN || std::abs(row) < least)
            throw Error(ErrorCode::InvalidArgument,
                        "{}: a row_stride of {} bytes is under a row of {} pixels, {} bytes", plane, row, columns,
                        least);
        if (row % bytes != 0 || reinterpret_cast<std::uintptr_t>(top) % std::size_t(bytes) != 0)
            throw Error(ErrorCode::InvalidArgument,
                        "{}: its address and row_stride, {} bytes, must be multiples of a sample's {} bytes", plane,
                        row, bytes);
        channel.top = top, channel.row = row, channel.pixel = pixel;
        if (planes > 1) {
            channels_[std::size_t(channelCount_++)] = channel;
            continue;
        }
        constexpr std::array<int, 4> rgba{0, 1, 2, 3}, bgra{2, 1, 0, 3};
        const auto& order = p_.layout == VIRGA_BGRA ? bgra : rgba;
        for (int c = 0; c < interleavedOf(p_.layout); ++c) {
            channels_[std::size_t(channelCount_++)] = channel;
            channels_[std::size_t(c)].top = top + order[std::size_t(c)] * bytes;
        }
    }
}

bool Picture::hasAlpha() const { return channelCount_ == 4; }

int Picture::bits() const
{
    return p_.significant_bits != 0 ? p_.significant_bits : p_.samples == VIRGA_UINT8 ? 8 : 16;
}

float Picture::largestCode() const { return float((1 << bits()) - 1); }

std::size_t Picture::sampleBytes() const { return p_.samples == VIRGA_UINT8 ? 1 : p_.samples == VIRGA_FLOAT ? 4 : 2; }

int Picture::chromaShiftX() const { return p_.layout == VIRGA_YUV420 || p_.layout == VIRGA_YUV422 ? 1 : 0; }
int Picture::chromaShiftY() const { return p_.layout == VIRGA_YUV420 ? 1 : 0; }

PlanarFormat Picture::planarFormat() const
{
    return {PlanarFormat::Family::Yuv, bits(), chromaShiftX(), chromaShiftY(), hasAlpha()};
}

YuvCoding Picture::coding() const
{
    YuvCoding coding;
    if (p_.matrix == VIRGA_BT601) coding.kr = 0.299, coding.kb = 0.114;
    if (p_.matrix == VIRGA_BT2020) coding.kr = 0.2627, coding.kb = 0.0593;
    coding.fullRange = p_.is_full_range != 0;
    return coding;
}

ChromaFilter Picture::chromaSiting() const
{
    ChromaFilter filter;
    filter.x = {chromaShiftX() > 0, p_.siting == VIRGA_SITING_CENTER ? 0.5 : 0.0};
    filter.y = {chromaShiftY() > 0, p_.siting == VIRGA_SITING_TOP_LEFT ? 0.0 : 0.5};
    return filter;
}

PlanarPicture Picture::planar(int x, int y, int width, int height) const
{
    PlanarPicture picture{width, height, {}, {}};
    for (int k = 0; k < channelCount_; ++k) {
        picture.planes[std::size_t(k)] = reinterpret_cast<std::uint8_t*>(channel(k).at(x, y));
        picture.strides[std::size_t(k)] = channel(k).row;
    }
    return picture;
}

bool Picture::isLike(const Picture& other) const
{
    const virga_picture &a = p_, &b = other.p_;
    const bool isSameCoding = !isYuv() || (a.matrix == b.matrix && (a.is_full_range != 0) == (b.is_full_range != 0));
    // Two orders of the same interleaved channels would be alike channel by channel; colours may not be mixed up.
    const bool isSameLayout = a.layout == b.layout || (interleavedOf(a.layout) == 4 && interleavedOf(b.layout) == 4);
    return isSameLayout && channelCount_ == other.channelCount_ && a.samples == b.samples && bits() == other.bits() &&
           isStraight() == other.isStraight() && colorspace_ == other.colorspace_ && isSameCoding;
}

}  // namespace virga::lib
