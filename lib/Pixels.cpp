#include "Pixels.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "core/Parallel.h"
#include "io/HalfRow.h"
#include "io/ImageFile.h"
#include "io/Yuv.h"

namespace virga::lib {
namespace {

constexpr std::ptrdiff_t rowsPerPiece = 16;

ConstPlanarPicture asConst(const PlanarPicture& picture)
{
    ConstPlanarPicture same{picture.width, picture.height, {}, picture.strides};
    std::copy(picture.planes.begin(), picture.planes.end(), same.planes.begin());
    return same;
}

template <class Sample>
void loadRow(const std::byte* from, std::ptrdiff_t step, int count, float scale, float* to, int toStep)
{
    for (int x = 0; x < count; ++x, from += step, to += toStep) {
        Sample sample;
        std::memcpy(&sample, from, sizeof sample);
        *to = float(sample) * scale;
    }
}

template <class Sample>
void storeRow(const float* from, int fromStep, int count, float largest, std::byte* to, std::ptrdiff_t step)
{
    for (int x = 0; x < count; ++x, from += fromStep, to += step) {
        float code = *from * largest + 0.5f;
        code = code > 0.0f ? code : 0.0f;  // NaN too
        const Sample sample = Sample(std::min(code, largest));
        std::memcpy(to, &sample, sizeof sample);
    }
}

void loadFloats(const std::byte* from, std::ptrdiff_t step, int count, float* to, int toStep)
{
    for (int x = 0; x < count; ++x, from += step, to += toStep) std::memcpy(to, from, sizeof *to);
}

void loadHalves(const std::byte* from, std::ptrdiff_t step, int count, float* to, int toStep)
{
    std::vector<std::uint16_t> halves{};
    std::vector<float> floats(static_cast<std::size_t>(count));
    halves.resize(std::size_t(count));
    for (int x = 0; x < count; ++x, from += step) std::memcpy(&halves[std::size_t(x)], from, sizeof(std::uint16_t));
    io::floatsFromHalves(halves.data(), floats.data(), halves.size());
    for (int x = 0; x < count; ++x, to += toStep) *to = floats[std::size_t(x)];
}

/// A row of one channel; integers times `scale`.
void loadChannel(const Picture& picture, const std::byte* from, std::ptrdiff_t step, int count, float scale, float* to,
                 int toStep)
{
    switch (picture.samples()) {
        case VIRGA_UINT8: return loadRow<std::uint8_t>(from, step, count, scale, to, toStep);
        case VIRGA_UINT16: return loadRow<std::uint16_t>(from, step, count, scale, to, toStep);
        case VIRGA_HALF: return loadHalves(from, step, count, to, toStep);
        case VIRGA_FLOAT: return loadFloats(from, step, count, to, toStep);
    }
}

void storeChannel(const Picture& picture, const float* from, int fromStep, int count, std::byte* to,
                  std::ptrdiff_t step)
{
    switch (picture.samples()) {
        case VIRGA_UINT8: return storeRow<std::uint8_t>(from, fromStep, count, picture.largestCode(), to, step);
        case VIRGA_UINT16: return storeRow<std::uint16_t>(from, fromStep, count, picture.largestCode(), to, step);
        case VIRGA_HALF:
            io::halvesFromFloats(from, std::size_t(fromStep), to, std::size_t(step), std::size_t(count));
            return;
        case VIRGA_FLOAT:
            for (int x = 0; x < count; ++x, from += fromStep, to += step) std::memcpy(to, from, sizeof *from);
            return;
    }
}

/// Luminance of Rec.709, of the codes; a grey of equal channels is exactly that.
void makeGrey(ImageF& rgb)
{
    for (std::size_t i = 0; i + 2 < rgb.size(); i += 3) {
        float* p = rgb.data() + i;
        if (p[0] != p[1] || p[1] != p[2]) p[0] = 0.2126f * p[0] + 0.7152f * p[1] + 0.0722f * p[2];
    }
}

/// The colours alone.
ImageF withoutAlpha(ConstImageViewF rgba)
{
    ImageF rgb(rgba.width(), rgba.height(), 3);
    for (int y = 0; y < rgba.height(); ++y)
        for (int x = 0; x < rgba.width(); ++x) std::copy_n(rgba.pixel(x, y), 3, rgb.pixel(x, y));
    return rgb;
}

ImageF copyOf(ConstImageViewF rgba)
{
    ImageF copy(rgba.width(), rgba.height(), 4);
    for (int y = 0; y < rgba.height(); ++y) std::copy_n(rgba.row(y), 4 * std::size_t(rgba.width()), copy.row(y));
    return copy;
}

}  // namespace

Window wholeChroma(const Picture& picture, const Window& part)
{
    const Window& all = picture.window();
    const int across = 1 << picture.chromaShiftX(), down = 1 << picture.chromaShiftY();
    const int left = part.x - (part.x - all.x) % across, top = part.y - (part.y - all.y) % down;
    const int right = std::min(all.right(), left + (part.right() - left + across - 1) / across * across);
    const int bottom = std::min(all.bottom(), top + (part.bottom() - top + down - 1) / down * down);
    return {left, top, right - left, bottom - top};
}

namespace {

ChromaFilter chromaFilter(const Picture& picture, const Picture* becomes)
{
    ChromaFilter filter = picture.chromaSiting();
    if (becomes != nullptr && becomes->isYuv()) {
        filter.x.isInterpolated = filter.x.isInterpolated && becomes->chromaShiftX() == 0;
        filter.y.isInterpolated = filter.y.isInterpolated && becomes->chromaShiftY() == 0;
    }
    return filter;
}

}  // namespace

bool interpolatesChroma(const Picture& picture, const Picture* becomes)
{
    const ChromaFilter filter = chromaFilter(picture, becomes);
    return filter.x.isInterpolated || filter.y.isInterpolated;
}

ImageF readPixels(const Picture& picture, const Window& part, const io::ColorTransform& toLinear,
                  const Picture* becomes)
{
    const int left = part.x - picture.window().x, top = part.y - picture.window().y;
    ImageF rgba(part.width, part.height, 4, 1.0f);
    if (picture.isYuv()) {
        io::planarToLinear(picture.planarFormat(), picture.coding(),
                           asConst(picture.planar(left, top, part.width, part.height)), toLinear, rgba,
                           chromaFilter(picture, becomes));
        return rgba;
    }
    // As writers divide: a code comes back as itself.
    const float scale = picture.isInteger() ? 1.0f / picture.largestCode() : 1.0f;
    const bool isGrey = picture.channels() == 1;
    parallelFor(0, part.height, rowsPerPiece, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y)
            for (int c = 0; c < (isGrey ? 3 : picture.channels()); ++c) {
                const Picture::Channel& channel = picture.channel(isGrey ? 0 : c);
                loadChannel(picture, channel.at(left, top + y), channel.pixel, part.width, scale, rgba.row(y) + c, 4);
            }
    });
    io::codesToLinear(rgba, toLinear, picture.isStraight(), picture.hasAlpha());
    return rgba;
}

ImageF readStored(const Picture& picture)
{
    const Window& window = picture.window();
    ImageF values(window.width, window.height, 1);
    const Picture::Channel& channel = picture.channel(0);
    for (int y = 0; y < window.height; ++y)
        loadChannel(picture, channel.at(0, y), channel.pixel, window.width, 1, values.row(y), 1);
    return values;
}

void writePixels(ConstImageViewF rgba, const Window& part, const Picture& picture, const io::ColorTransform& toCodes)
{
    const int left = part.x - picture.window().x, top = part.y - picture.window().y;
    if (picture.isYuv()) {
        io::linearToPlanar(picture.planarFormat(), picture.coding(), rgba, toCodes,
                           picture.planar(left, top, part.width, part.height));
        return;
    }
    ImageF codes = picture.hasAlpha() ? copyOf(rgba) : withoutAlpha(rgba);
    io::linearToCodes(codes, toCodes, picture.isStraight());
    if (picture.channels() == 1) makeGrey(codes);
    parallelFor(0, part.height, rowsPerPiece, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y)
            for (int c = 0; c < picture.channels(); ++c) {
                const Picture::Channel& channel = picture.channel(c);
                storeChannel(picture, codes.row(y) + c, codes.channels(), part.width, channel.at(left, top + y),
                             channel.pixel);
            }
    });
}

void copyPixels(const Picture& from, const Picture& to, const Window& part)
{
    const auto bytes = from.sampleBytes();
    for (int c = 0; c < from.channels(); ++c) {
        const Picture::Channel &a = from.channel(c), &b = to.channel(c);
        const int columns = (part.width + (1 << a.shiftX) - 1) >> a.shiftX;
        const int rows = (part.height + (1 << a.shiftY) - 1) >> a.shiftY;
        for (int y = 0; y < rows; ++y) {
            const std::byte* source =
                a.at(part.x - from.window().x, part.y - from.window().y) + std::ptrdiff_t(y) * a.row;
            std::byte* target = b.at(part.x - to.window().x, part.y - to.window().y) + std::ptrdiff_t(y) * b.row;
            for (int x = 0; x < columns; ++x, source += a.pixel, target += b.pixel)
                if (source != target) std::memcpy(target, source, bytes);
        }
    }
}

}  // namespace virga::lib
