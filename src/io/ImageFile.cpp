#include "io/ImageFile.h"

#include <Imath/half.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <string_view>

#include "core/Error.h"
#include "core/Parallel.h"
#include "io/AtomicFile.h"
#include "io/ImageColor.h"
#include "io/Libav.h"
#include "io/PngCheck.h"

namespace virga::io {

namespace fs = std::filesystem;
using OIIO::ImageInput;
using OIIO::ImageOutput;
using OIIO::ImageSpec;
using OIIO::TypeDesc;

namespace {

constexpr std::ptrdiff_t rowsPerPiece = 16;

std::string extensionOf(const std::string& path)
{
    std::string extension = fs::path(path).extension().string();
    if (!extension.empty()) extension.erase(0, 1);
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    return extension;
}

/// Extensions -> format, of all formats that OpenImageIO was built with and that are pictures made by pixels.
const std::map<std::string, std::string>& formatsByExtension()
{
    static const std::map<std::string, std::string> formats = [] {
        std::map<std::string, std::string> result;
        for (const auto& [format, extensions] : OIIO::get_extension_map()) {
            // Movies are read through FFmpeg; "null" makes up pictures; "term" draws on the terminal.
            if (format == "ffmpeg" || format == "null" || format == "term" || format == "openvdb" ||
                format == "field3d" || format == "ptex")
                continue;
            for (const std::string& extension : extensions) result.emplace(extension, format);
        }
        return result;
    }();
    return formats;
}

Attribute toAttribute(const OIIO::ParamValue& value)
{
    Attribute attribute{value.name().string(), value.type().c_str(), {}, {}};
    if (value.type().basetype == TypeDesc::STRING) {
        const auto* texts = static_cast<const OIIO::ustring*>(value.data());
        for (std::size_t i = 0; i < value.type().numelements() * std::size_t(value.nvalues()); ++i)
            attribute.strings.push_back(texts[i].string());
    } else {
        const auto* bytes = static_cast<const std::byte*>(value.data());
        attribute.data.assign(bytes, bytes + value.datasize());
    }
    return attribute;
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

/// What belongs to the file that was read and not to the picture in it, or is set anew for the one that is written.
bool isOfTheFile(const std::string& name)
{
    static const char* const prefixes[] = {"oiio:", "openexr:", "png:", "tiff:", "jpeg:", "webp:"};
    static const char* const names[] = {"compression", "CompressionQuality", "PixelAspectRatio", "FramesPerSecond",
                                        "chunkCount",  "textureformat",      "planarconfig",     "ResolutionUnit"};
    return std::any_of(std::begin(prefixes), std::end(prefixes), [&](const char* p) { return name.starts_with(p); }) ||
           std::any_of(std::begin(names), std::end(names), [&](const char* n) { return name == n; });
}

ImageColorWords colorWordsOf(const ImageInput& input, const std::string& path)
{
    const ImageSpec& spec = input.spec();
    ImageColorWords words;
    words.isFloat = spec.format.is_floating_point();
    words.interopId = spec.get_string_attribute("colorInteropID");
    words.isAcesContainer = spec.get_int_attribute("acesImageContainerFlag") == 1;
    words.profile = spec.get_string_attribute("ICCProfile:profile_description");
    words.hasProfile = spec.find_attribute("ICCProfile") != nullptr;
    words.transfer = spec.get_string_attribute("oiio:ColorSpace");
    if (const auto cicp = cicpOfPng(path)) words.cicp = libav::colorClaimOf((*cicp)[1], (*cicp)[0], (*cicp)[2]);
    // OpenImageIO says so of every picture that is silent; the file itself does in its Exif block or in a PNG's chunk.
    const bool isSaid = spec.get_int_attribute("Exif:ColorSpace") == 1 ||
                        (std::string_view(input.format_name()) == "png" && !isPngWithoutColorspace(path));
    if (words.transfer == "sRGB" && !isSaid) words.transfer.clear();
    if (const auto* found = spec.find_attribute("chromaticities", TypeDesc(TypeDesc::FLOAT, 8))) {
        std::array<float, 8> values{};
        std::copy_n(static_cast<const float*>(found->data()), values.size(), values.begin());
        words.chromaticities = values;
    }
    return words;
}

/// OpenImageIO gathers what several layers below it say, a line each; the first is where it went wrong.
std::string firstLine(const std::string& text) { return text.substr(0, text.find('\n')); }

std::unique_ptr<ImageInput> open(const std::string& path)
{
    std::error_code error;
    if (fs::is_directory(path, error))
        throw Error(ErrorCode::Input, "{}: is a folder; name a movie, an image or a pattern such as {}", path,
                    (fs::path(path) / "shot.%04d.exr").string());
    if (!fs::exists(path, error)) throw Error(ErrorCode::Input, "{}: does not exist", path);
    if (fs::is_regular_file(path, error) && fs::file_size(path, error) == 0)
        throw Error(ErrorCode::Input, "{}: is empty", path);
    if (const auto damage = damageOfPng(path))
        throw Error(ErrorCode::Input, "{}: is damaged or cut off ({})", path, *damage);
    ImageSpec request;
    request.attribute("oiio:UnassociatedAlpha", 1);
    auto input = ImageInput::open(path, &request);
    if (!input)
        throw Error(ErrorCode::Input, "{}: is not an image that can be read ({})", path, firstLine(OIIO::geterror()));
    if (input->spec().deep)
        throw Error(ErrorCode::Input, "{}: is a deep image, which cannot be read; flatten it first", path);
    return input;
}

ImageHeader headerOf(const ImageInput& input, const std::string& path)
{
    const ImageSpec& spec = input.spec();
    ImageHeader header;
    header.format = input.format_name();
    header.width = spec.full_width > 0 ? spec.full_width : spec.width;
    header.height = spec.full_height > 0 ? spec.full_height : spec.height;
    if (spec.nchannels < 1 || header.width < 1 || header.height < 1)
        throw Error(ErrorCode::Input, "{}: holds no pixels", path);
    header.channelNames = spec.channelnames;
    header.isFloat = spec.format.is_floating_point();
    header.bitDepth = spec.get_int_attribute("oiio:BitsPerSample", int(spec.format.size()) * 8);
    header.isStraight = spec.get_int_attribute("oiio:UnassociatedAlpha", 0) != 0;
    header.hasAlpha = spec.alpha_channel >= 0;
    header.pixelAspect = spec.get_float_attribute("PixelAspectRatio", 1.0f);
    if (!(header.pixelAspect > 0)) header.pixelAspect = 1;
    if (const auto* rate = spec.find_attribute("FramesPerSecond", OIIO::TypeRational)) {
        const int* fraction = static_cast<const int*>(rate->data());
        if (fraction[0] > 0 && fraction[1] > 0) header.fps = double(fraction[0]) / fraction[1];
    }
    header.colorClaims = colorClaims(colorWordsOf(input, path));
    for (const OIIO::ParamValue& value : spec.extra_attribs)
        if (!isOfTheFile(value.name().string())) header.attributes.push_back(toAttribute(value));
    // Kept apart from the rest, so that a plate that was compressed without loss stays so in the same way.
    if (const std::string compression = spec.get_string_attribute("compression"); !compression.empty())
        header.attributes.push_back({"compression", "string", {}, {compression}});
    return header;
}

/// OpenImageIO reads a DPX that is cut off as if it were whole. Its header says how long it should be (SMPTE
/// 268M, 4.1).
void checkDpxSize(const std::string& path)
{
    std::array<unsigned char, 20> header{};
    std::ifstream file(path, std::ios::binary);
    if (!file.read(reinterpret_cast<char*>(header.data()), header.size())) return;
    const bool isBigEndian = header[0] == 'S';
    std::uint32_t promised = 0;
    for (std::size_t i = 0; i < 4; ++i) promised = promised << 8 | header[16 + (isBigEndian ? i : 3 - i)];
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(path, error);
    if (!error && promised != 0xffffffff && promised <= (1u << 31) && size < promised)
        throw Error(ErrorCode::Input, "{}: is cut off: {} of {} bytes are there", path, size, promised);
}

/// Reads channels [first, last) of the data window and places them in the display window.
ImageF readChannels(ImageInput& input, const ImageHeader& header, const std::string& path, int first, int last,
                    bool normalize)
{
    const ImageSpec& spec = input.spec();
    const int count = last - first;
    if (header.format == "dpx") checkDpxSize(path);
    // Half is converted here, so that every bit pattern survives; integers that are to stay as they are too.
    TypeDesc type = TypeDesc::FLOAT;
    if (spec.format == TypeDesc::HALF && spec.channelformats.empty()) type = TypeDesc::HALF;
    if (!normalize && !spec.format.is_floating_point()) type = spec.format;
    std::vector<std::byte> raw(std::size_t(spec.width) * std::size_t(spec.height) * std::size_t(count) * type.size());
    // A strip or scanline that is cut off may leave a message alone, with the pixels before it in its place.
    if (!input.read_image(0, 0, first, last, type, raw.data()) || input.has_error())
        throw Error(ErrorCode::Input, "{}: is damaged or cut off ({})", path, firstLine(input.geterror()));

    ImageF image(header.width, header.height, count);
    const int left = std::max(0, spec.x - spec.full_x),
              right = std::min(header.width, spec.x - spec.full_x + spec.width);
    if (left >= right) return image;
    const auto convertRow = [&](const auto* from, float* to) {
        for (int i = 0; i < (right - left) * count; ++i) to[i] = float(from[i]);
    };
    parallelFor(0, header.height, rowsPerPiece, [&](std::ptrdiff_t top, std::ptrdiff_t bottom) {
        for (std::ptrdiff_t y = top; y < bottom; ++y) {
            const std::ptrdiff_t dataY = y + spec.full_y - spec.y;
            if (dataY < 0 || dataY >= spec.height) continue;
            const std::size_t start =
                (std::size_t(dataY) * std::size_t(spec.width) + std::size_t(left + spec.full_x - spec.x)) *
                std::size_t(count);
            const std::byte* from = raw.data() + start * type.size();
            float* to = image.pixel(left, int(y));
            switch (type.basetype) {
                case TypeDesc::FLOAT:
                    std::memcpy(to, from, std::size_t(right - left) * std::size_t(count) * sizeof(float));
                    break;
                case TypeDesc::HALF: {
                    const auto* bits = reinterpret_cast<const std::uint16_t*>(from);
                    for (int i = 0; i < (right - left) * count; ++i) to[i] = imath_half_to_float(bits[i]);
                    break;
                }
                case TypeDesc::UINT8: convertRow(reinterpret_cast<const std::uint8_t*>(from), to); break;
                case TypeDesc::INT8: convertRow(reinterpret_cast<const std::int8_t*>(from), to); break;
                case TypeDesc::UINT16: convertRow(reinterpret_cast<const std::uint16_t*>(from), to); break;
                case TypeDesc::INT16: convertRow(reinterpret_cast<const std::int16_t*>(from), to); break;
                case TypeDesc::UINT32: convertRow(reinterpret_cast<const std::uint32_t*>(from), to); break;
                case TypeDesc::INT32: convertRow(reinterpret_cast<const std::int32_t*>(from), to); break;
                default: throw Error(ErrorCode::Input, "{}: its {} samples are not supported", path, type.c_str());
            }
        }
    });
    return image;
}

/// Where R G B and A are among the channels; alpha -1 if there is none.
struct RgbaChannels {
    int red = 0, green = 0, blue = 0, alpha = -1;
};

int channelNamed(const ImageSpec& spec, const std::string& name)
{
    const auto found = std::find_if(spec.channelnames.begin(), spec.channelnames.end(),
                                    [&](const std::string& n) { return OIIO::Strutil::iequals(n, name); });
    return found == spec.channelnames.end() ? -1 : int(found - spec.channelnames.begin());
}

RgbaChannels channelsOfLayer(const ImageSpec& spec, const std::string& layer)
{
    return {channelNamed(spec, layer + ".R"), channelNamed(spec, layer + ".G"), channelNamed(spec, layer + ".B"),
            channelNamed(spec, layer + ".A")};
}

/// What stands before ".R" where ".G" and ".B" are there too, in the order of the file.
std::vector<std::string> layersOf(const ImageSpec& spec)
{
    std::vector<std::string> layers;
    for (const std::string& name : spec.channelnames) {
        if (name.size() < 3 || !OIIO::Strutil::iends_with(name, ".R")) continue;
        const std::string layer = name.substr(0, name.size() - 2);
        const RgbaChannels c = channelsOfLayer(spec, layer);
        if (c.green >= 0 && c.blue >= 0) layers.push_back(layer);
    }
    return layers;
}

/// `layer`: its name; empty: R, G, B without one, else the only layer, else the one that programs give the whole
/// picture. Throws Error(Input) listing what there is.
RgbaChannels rgbaChannels(const ImageSpec& spec, const std::string& path, const std::string& layer)
{
    const std::vector<std::string> layers = layersOf(spec);
    if (!layer.empty()) {
        const RgbaChannels c = channelsOfLayer(spec, layer);
        if (c.red < 0 || c.green < 0 || c.blue < 0)
            throw Error(ErrorCode::Input, "{}: has no layer '{}'; {}", path, layer,
                        layers.empty() ? "it has none" : fmt::format("there are {}", fmt::join(layers, ", ")));
        return c;
    }
    const RgbaChannels plain{channelNamed(spec, "R"), channelNamed(spec, "G"), channelNamed(spec, "B"),
                             spec.alpha_channel};
    if (plain.red >= 0 && plain.green >= 0 && plain.blue >= 0) return plain;
    if (layers.size() == 1) return channelsOfLayer(spec, layers[0]);
    if (!layers.empty()) {
        std::vector<std::string> whole;
        for (const std::string& name : layers)
            for (const char* usual : {"rgba", "combined", "beauty"})
                if (OIIO::Strutil::iequals(name.substr(name.rfind('.') + 1), usual)) whole.push_back(name);
        if (whole.size() == 1) return channelsOfLayer(spec, whole[0]);
        throw Error(ErrorCode::Input, "{}: holds the layers {}; choose with --layer", path, fmt::join(layers, ", "));
    }
    const int colors = spec.nchannels - (spec.alpha_channel >= 0 ? 1 : 0);
    const int luminance = channelNamed(spec, "Y");
    if (luminance >= 0 || colors < 3) {
        const int grey = luminance >= 0 ? luminance : spec.alpha_channel == 0 && spec.nchannels > 1 ? 1 : 0;
        return {grey, grey, grey, spec.alpha_channel == grey ? -1 : spec.alpha_channel};
    }
    // Formats without names for their channels have colours first.
    const std::string& first = spec.channelnames[0];
    if (first != "R" && !OIIO::Strutil::istarts_with(first, "channel"))
        throw Error(ErrorCode::Input, "{}: holds no colours, but {}", path, fmt::join(spec.channelnames, ", "));
    return {0, 1, 2, spec.alpha_channel > 2 ? spec.alpha_channel : -1};
}

/// What of the file is not read, a sentence each.
std::vector<std::string> leftOutOf(ImageInput& input, const std::string& path, const RgbaChannels& c)
{
    std::vector<std::string> said, others;
    const ImageSpec& spec = input.spec();
    for (int i = 0; i < spec.nchannels; ++i)
        if (i != c.red && i != c.green && i != c.blue && i != c.alpha)
            others.push_back(spec.channelnames[std::size_t(i)]);
    if (!others.empty())
        said.push_back(fmt::format("{}: these channels are not in the result: {}", path, fmt::join(others, ", ")));
    if (spec.x < spec.full_x || spec.y < spec.full_y || spec.x + spec.width > spec.full_x + spec.full_width ||
        spec.y + spec.height > spec.full_y + spec.full_height)
        said.push_back(
            fmt::format("{}: its picture reaches beyond the display window; that overscan is left out", path));
    if (std::strcmp(input.format_name(), "openexr") == 0 && input.seek_subimage(1, 0)) {
        said.push_back(fmt::format("{}: has several parts or views; the first is taken", path));
        input.seek_subimage(0, 0);
    }
    return said;
}

/// Formats that tests/io/image_test.cpp writes and reads back. OpenImageIO lists more, of which some cannot hold these
/// pictures (zfile), lose their colours (iff) or end the program (gif, 2.4).
constexpr const char* writtenExtensions[] = {"exr", "png",  "tif", "tiff", "dpx", "jpg", "jpeg",
                                             "hdr", "webp", "tga", "bmp",  "ppm", "sgi"};

/// OpenImageIO's name of the format that files with this extension are written in, or null.
const std::string* writtenFormat(const std::string& extension)
{
    if (std::find(std::begin(writtenExtensions), std::end(writtenExtensions), extension) == std::end(writtenExtensions))
        return nullptr;
    const auto found = formatsByExtension().find(extension);
    return found == formatsByExtension().end() ? nullptr : &found->second;
}

std::string listOfFormats()
{
    std::vector<std::string> extensions;
    for (const std::string extension : writtenExtensions)
        if (extension != "tiff" && extension != "jpeg" && writtenFormat(extension) != nullptr)
            extensions.push_back("." + extension);
    return fmt::format("{}", fmt::join(extensions, ", "));
}

}  // namespace

bool isImageName(const std::string& path) { return formatsByExtension().contains(extensionOf(path)); }

std::optional<std::array<double, 16>> matrixAttribute(const ImageHeader& header, std::string_view name)
{
    std::array<double, 16> numbers{};
    const auto take = [&](const Attribute& attribute, auto sample) {
        std::array<decltype(sample), 16> stored;
        if (attribute.data.size() != sizeof stored) return false;
        std::memcpy(stored.data(), attribute.data.data(), sizeof stored);
        std::copy(stored.begin(), stored.end(), numbers.begin());
        return true;
    };
    for (const Attribute& attribute : header.attributes) {
        const TypeDesc type(attribute.type.c_str());
        if (type.aggregate != TypeDesc::MATRIX44 || !OIIO::Strutil::iequals(attribute.name, std::string(name)))
            continue;
        if (type.basetype == TypeDesc::FLOAT && take(attribute, float())) return numbers;
        if (type.basetype == TypeDesc::DOUBLE && take(attribute, double())) return numbers;
    }
    return std::nullopt;
}

ImageHeader readImageHeader(const std::string& path) { return headerOf(*open(path), path); }

ImageF readAllChannels(const std::string& path, ImageHeader& header, bool normalize)
{
    const auto input = open(path);
    header = headerOf(*input, path);
    return readChannels(*input, header, path, 0, input->spec().nchannels, normalize);
}

ImageHeader readPictureHeader(const std::string& path, const std::string& layer)
{
    const auto input = open(path);
    ImageHeader header = headerOf(*input, path);
    const RgbaChannels c = rgbaChannels(input->spec(), path, layer);
    header.hasAlpha = c.alpha >= 0;
    header.layers = layersOf(input->spec());
    header.leftOut = leftOutOf(*input, path, c);
    return header;
}

ImageF readCodedRgba(const std::string& path, ImageHeader& header, const std::string& layer)
{
    const auto input = open(path);
    header = headerOf(*input, path);
    const RgbaChannels c = rgbaChannels(input->spec(), path, layer);
    header.hasAlpha = c.alpha >= 0;
    const int first = std::min({c.red, c.green, c.blue, c.alpha >= 0 ? c.alpha : c.red});
    const int last = std::max({c.red, c.green, c.blue, c.alpha}) + 1;
    ImageF read = readChannels(*input, header, path, first, last, true);
    if (last - first == 4 && c.red == first && c.green == first + 1 && c.blue == first + 2 && c.alpha == first + 3)
        return read;

    ImageF rgba(header.width, header.height, 4);
    parallelFor(0, header.height, rowsPerPiece, [&](std::ptrdiff_t top, std::ptrdiff_t bottom) {
        for (std::ptrdiff_t y = top; y < bottom; ++y)
            for (int x = 0; x < header.width; ++x) {
                const float* from = read.pixel(x, int(y)) - first;
                float* to = rgba.pixel(x, int(y));
                to[0] = from[c.red];
                to[1] = from[c.green];
                to[2] = from[c.blue];
                to[3] = c.alpha >= 0 ? from[c.alpha] : 1.0f;
            }
    });
    return rgba;
}

namespace {

/// Takes rows apart into red, green and blue, with or without alpha in them, and puts them together again.
template <bool divideBefore, bool multiplyAfter>
void transformRows(ImageView<float> pixels, const ColorTransform& transform)
{
    const bool hasAlpha = pixels.channels() == 4;
    parallelFor(0, pixels.height(), rowsPerPiece, [&](std::ptrdiff_t top, std::ptrdiff_t bottom) {
        const std::size_t width = std::size_t(pixels.width());
        std::vector<float> rows(3 * width);
        float *red = rows.data(), *green = red + width, *blue = green + width;
        for (std::ptrdiff_t y = top; y < bottom; ++y) {
            float* row = pixels.row(int(y));
            const std::size_t step = std::size_t(pixels.channels());
            for (std::size_t x = 0; x < width; ++x) {
                const float* p = row + step * x;
                float scale = 1.0f;
                if (divideBefore && hasAlpha) scale = p[3] > 0.0f ? 1.0f / p[3] : 0.0f;
                red[x] = p[0] * scale;
                green[x] = p[1] * scale;
                blue[x] = p[2] * scale;
            }
            transform.apply(red, green, blue, width);
            for (std::size_t x = 0; x < width; ++x) {
                float* p = row + step * x;
                const float scale = multiplyAfter && hasAlpha ? p[3] : 1.0f;
                p[0] = red[x] * scale;
                p[1] = green[x] * scale;
                p[2] = blue[x] * scale;
            }
        }
    });
}

}  // namespace

void codesToLinear(ImageF& rgba, const ColorTransform& toLinear, bool isStraight, bool hasAlpha)
{
    if (!hasAlpha && toLinear.isIdentity()) return;
    if (!hasAlpha)
        transformRows<false, false>(rgba, toLinear);
    else if (isStraight)
        transformRows<false, true>(rgba, toLinear);
    else if (!toLinear.isIdentity())
        transformRows<true, true>(rgba, toLinear);
}

void linearToCodes(ImageView<float> pixels, const ColorTransform& toCodes, bool isStraight)
{
    const bool hasAlpha = pixels.channels() == 4;
    if (toCodes.isIdentity() && !(hasAlpha && isStraight)) return;
    if (isStraight)
        transformRows<true, false>(pixels, toCodes);
    else
        transformRows<true, true>(pixels, toCodes);
}

std::string imageFormatOf(const std::string& path)
{
    const std::string* format = writtenFormat(extensionOf(path));
    if (format == nullptr || !ImageOutput::create(*format)) {
        OIIO::geterror();  // said better here
        throw Error(
            ErrorCode::Output,
            "{}: '.{}' is no format that can be written; there are {} for images and .mp4, .mov, .mkv, .webm, .avi for "
            "movies",
            path, extensionOf(path), listOfFormats());
    }
    return *format;
}

bool formatHasAlpha(const std::string& path)
{
    const auto output = ImageOutput::create(imageFormatOf(path));
    return output && output->supports("alpha") != 0;
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
        const TypeDesc type = channel.type == SampleType::UInt8    ? TypeDesc::UINT8
                              : channel.type == SampleType::UInt16 ? TypeDesc::UINT16
                              : channel.type == SampleType::Half   ? TypeDesc::HALF
                                                                   : TypeDesc::FLOAT;
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
    if (image.fps > 0) {
        // 24000/1001 and its kin are what film and video run at; anything else to a thousandth.
        const bool isNtsc = std::fabs(image.fps * 1.001 - std::round(image.fps * 1.001)) < 1e-4 &&
                            std::fabs(image.fps - std::round(image.fps)) > 1e-4;
        const bool isWhole = std::fabs(image.fps - std::round(image.fps)) < 1e-6;
        const int fraction[2] = {int(std::lround(isNtsc    ? std::round(image.fps * 1.001) * 1000
                                                 : isWhole ? image.fps
                                                           : image.fps * 1000)),
                                 isNtsc    ? 1001
                                 : isWhole ? 1
                                           : 1000};
        spec.attribute("FramesPerSecond", OIIO::TypeRational, fraction);
    }

    std::vector<std::byte> raw(std::size_t(width) * std::size_t(height) * pixelBytes);
    std::atomic<std::size_t> tooLarge = 0;
    parallelFor(0, height, rowsPerPiece, [&](std::ptrdiff_t top, std::ptrdiff_t bottom) {
        std::size_t clamped = 0;
        for (std::size_t c = 0; c < image.channels.size(); ++c) {
            const auto& channel = image.channels[c];
            const int bits = image.bits != 0 ? image.bits : channel.type == SampleType::UInt8 ? 8 : 16;
            const float most = float((1 << bits) - 1);
            for (std::ptrdiff_t y = top; y < bottom; ++y) {
                std::byte* to = raw.data() + std::size_t(y) * std::size_t(width) * pixelBytes + offsets[c];
                const float* from = channel.pixels.row(int(y)) + channel.index;
                const int step = channel.pixels.channels();
                for (int x = 0; x < width; ++x, to += pixelBytes, from += step) {
                    const float value = *from;
                    if (channel.type == SampleType::Float) {
                        std::memcpy(to, &value, sizeof value);
                    } else if (channel.type == SampleType::Half) {
                        std::uint16_t bitsOfHalf = imath_float_to_half(value);
                        if ((bitsOfHalf & 0x7fff) == 0x7c00 && std::isfinite(value)) {
                            bitsOfHalf = std::uint16_t((bitsOfHalf & 0x8000) | 0x7bff);
                            ++clamped;
                        }
                        std::memcpy(to, &bitsOfHalf, sizeof bitsOfHalf);
                    } else {
                        float code = value * most + 0.5f;
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
        }
        tooLarge += clamped;
    });

    AtomicFile file(path);
    if (!output->open(file.temporaryPath(), spec))
        throw Error(ErrorCode::Output, "{}: cannot be written ({})", path, firstLine(output->geterror()));
    const bool isWritten = output->write_image(TypeDesc::UNKNOWN, raw.data());
    if (!output->close() || !isWritten)
        throw Error(ErrorCode::Output, "{}: cannot be written ({})", path, firstLine(output->geterror()));
    file.commit();
    return tooLarge;
}

}  // namespace virga::io
