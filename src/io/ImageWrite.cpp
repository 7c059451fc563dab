#include "io/ImageWrite.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>

#include "core/Error.h"
#include "core/Parallel.h"
#include "core/Words.h"
#include "io/AtomicFile.h"
#include "io/HalfRow.h"
#include "io/ImageFormats.h"
#include "io/WebpFile.h"

namespace virga::io {

using OIIO::ImageOutput;
using OIIO::ImageSpec;
using OIIO::TypeDesc;

namespace {

constexpr std::ptrdiff_t rowsPerPiece = 16;
constexpr int rowsPerBand = 256;  // of samples as they stand in the file, at a time; a multiple of all formats' blocks

TypeDesc typeOf(SampleType type)
{
    switch (type) {
        case SampleType::UInt8: return TypeDesc::UINT8;
        case SampleType::UInt16: return TypeDesc::UINT16;
        case SampleType::Half: return TypeDesc::HALF;
        case SampleType::Float: break;
    }
    return TypeDesc::FLOAT;
}

void setAttribute(ImageSpec& spec, const Attribute& attribute)
{
    const TypeDesc type(attribute.type.c_str());
    if (type.basetype == TypeDesc::STRING) {
        std::vector<const char*> texts;
        for (const std::string& text : attribute.strings) texts.push_back(text.c_str());
        if (!texts.empty()) spec.attribute(attribute.name, type, texts.data());
    } else if (attribute.data.size() == type.size()) {
        spec.attribute(attribute.name, type, attribute.data.data());
    }
}

/// Rows [firstRow, endRow) of the picture in the order and with the samples of the file. Returns the number of values
/// held at 65504.
std::size_t pack(const ImageToWrite& image, int firstRow, int endRow, const std::vector<std::size_t>& offsets,
                 std::size_t pixelBytes, std::vector<std::byte>& raw)
{
    const auto width = std::size_t(image.channels.front().pixels.width());
    raw.resize(width * std::size_t(endRow - firstRow) * pixelBytes);
    std::atomic<std::size_t> tooLarge = 0;
    parallelFor(firstRow, endRow, rowsPerPiece, [&](std::ptrdiff_t top, std::ptrdiff_t bottom) {
        std::size_t clamped = 0;
        for (std::size_t c = 0; c < image.channels.size(); ++c) {
            const auto& channel = image.channels[c];
            const int bits = image.bits != 0 ? image.bits : channel.type == SampleType::UInt8 ? 8 : 16;
            const float most = float((1 << bits) - 1);
            for (std::ptrdiff_t y = top; y < bottom; ++y) {
                std::byte* to = raw.data() + std::size_t(y - firstRow) * width * pixelBytes + offsets[c];
                const float* from = channel.pixels.row(int(y)) + channel.index;
                const auto step = std::size_t(channel.pixels.channels());
                if (channel.type == SampleType::Half) {
                    clamped += halvesFromFloats(from, step, to, pixelBytes, width);
                    continue;
                }
                for (std::size_t x = 0; x < width; ++x, to += pixelBytes, from += step) {
                    if (channel.type == SampleType::Float) {
                        std::memcpy(to, from, sizeof *from);
                        continue;
                    }
                    float code = *from * most + 0.5f;
                    code = code > 0.0f ? code : 0.0f;
                    const auto whole = std::uint32_t(std::min(code, most));
                    if (channel.type == SampleType::UInt8) {
                        *to = std::byte(whole);
                    } else {
                        // Fewer bits are repeated downwards, so that the format's own narrowing gives them back.
                        const auto wide =
                            std::uint16_t(bits < 16 ? (whole << (16 - bits)) | (whole >> (2 * bits - 16)) : whole);
                        std::memcpy(to, &wide, sizeof wide);
                    }
                }
            }
        }
        tooLarge += clamped;
    });
    return tooLarge;
}

}  // namespace

std::array<int, 2> rateFraction(double fps)
{
    const bool isNtsc =
        std::fabs(fps * 1.001 - std::round(fps * 1.001)) < 1e-4 && std::fabs(fps - std::round(fps)) > 1e-4;
    if (isNtsc) return {int(std::lround(std::round(fps * 1.001) * 1000)), 1001};
    const bool isWhole = std::fabs(fps - std::round(fps)) < 1e-6;
    return {int(std::lround(isWhole ? fps : fps * 1000)), isWhole ? 1 : 1000};
}

std::size_t writeImageFile(const std::string& path, const ImageToWrite& image)
{
    const ConstImageViewF first = image.channels.front().pixels;
    const int width = first.width(), height = first.height(), count = int(image.channels.size());
    const std::string format = imageFormatOf(path);
    const auto output = ImageOutput::create(format);

    ImageSpec spec(width, height, count, TypeDesc::FLOAT);
    std::vector<std::size_t> offsets;
    std::size_t pixelBytes = 0;
    spec.channelnames.clear();
    spec.alpha_channel = spec.z_channel = -1;
    for (const auto& channel : image.channels) {
        if (channel.name == "A") spec.alpha_channel = int(spec.channelnames.size());
        if (channel.name == "Z") spec.z_channel = int(spec.channelnames.size());
        spec.channelnames.push_back(channel.name);
        const TypeDesc type = typeOf(channel.type);
        spec.channelformats.push_back(type);
        offsets.push_back(pixelBytes);
        pixelBytes += type.size();
    }
    spec.format = spec.channelformats.front();
    if (std::all_of(spec.channelformats.begin(), spec.channelformats.end(),
                    [&](TypeDesc t) { return t == spec.format; }))
        spec.channelformats.clear();

    for (const Attribute& attribute : image.attributes) setAttribute(spec, attribute);
    if (!image.compression.empty()) spec.attribute("compression", image.compression);
    if (image.bits != 0) spec.attribute("oiio:BitsPerSample", image.bits);
    if (image.isStraight) spec.attribute("oiio:UnassociatedAlpha", 1);
    if (image.pixelAspect != 1) spec.attribute("PixelAspectRatio", float(image.pixelAspect));
    if (image.fps > 0) spec.attribute("FramesPerSecond", OIIO::TypeRational, rateFraction(image.fps).data());
    if (format == "tiff" && spec.format == TypeDesc::HALF) spec.attribute("tiff:half", 1);

    std::vector<std::byte> raw;
    AtomicFile file(path);
    const MemoryFile memory;
    if (format == "webp" && count == 4) {
        const std::size_t tooLarge = pack(image, 0, height, offsets, pixelBytes, raw);
        std::vector<std::uint8_t> codes(raw.size());
        std::memcpy(codes.data(), raw.data(), raw.size());
        const bool isLossless = image.compression.starts_with("lossless");
        const std::size_t colon = image.compression.find(':');
        const float quality = colon == std::string::npos ? 95.0f : std::stof(image.compression.substr(colon + 1));
        const std::string fault = writeWebpRgba(memory.path(), codes, width, height,
                                                isLossless ? std::nullopt : std::optional<float>(quality));
        if (!fault.empty()) throw Error(ErrorCode::Output, "{}: cannot be written ({})", path, fault);
        memory.writeTo(file);
        file.commit();
        return tooLarge;
    }
    if (!output->open(memory.path(), spec))
        throw Error(ErrorCode::Output, "{}: cannot be written ({})", path, firstLine(output->geterror()));
    std::size_t tooLarge = 0;
    bool isWritten = true;
    for (int row = 0; row < height && isWritten; row += rowsPerBand) {
        const int end = std::min(row + rowsPerBand, height);
        tooLarge += pack(image, row, end, offsets, pixelBytes, raw);
        isWritten = output->write_scanlines(row, end, 0, TypeDesc::UNKNOWN, raw.data());
    }
    if (!output->close() || !isWritten)
        throw Error(ErrorCode::Output, "{}: cannot be written ({})", path, firstLine(output->geterror()));
    memory.writeTo(file);
    file.commit();
    return tooLarge;
}

}  // namespace virga::io
