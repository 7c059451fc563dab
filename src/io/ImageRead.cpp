#include <OpenImageIO/imageio.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <new>

#include "core/Error.h"
#include "core/Parallel.h"
#include "core/Words.h"
#include "io/HalfRow.h"
#include "io/ImageColor.h"
#include "io/ImageFile.h"
#include "io/Libav.h"
#include "io/PngCheck.h"
#include "io/WebpFile.h"

namespace virga::io {

namespace fs = std::filesystem;
using OIIO::ImageInput;
using OIIO::ImageSpec;
using OIIO::TypeDesc;

namespace {

constexpr std::ptrdiff_t rowsPerPiece = 16;

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
    ImageSpec request, spec;
    request.attribute("oiio:UnassociatedAlpha", 1);
    std::string reason;
    for (const std::string& format : formatsToTry(path)) {
        auto input = ImageInput::create(format);
        if (!input) continue;
        if (input->open(path, spec, request)) {
            OIIO::geterror();
            return input;
        }
        const std::string said = firstLine(input->geterror());
        if (reason.empty()) reason = said;
    }
    OIIO::geterror();
    throw Error(ErrorCode::Input, "{}: is not an image that can be read ({})", path, reason);
}

Attribute toAttribute(const OIIO::ParamValue& value)
{
    // TypeDesc cannot read its own word for the type of a rational.
    const bool isRational = value.type() == OIIO::TypeRational;
    Attribute attribute{value.name().string(), isRational ? "rational" : value.type().c_str(), {}, {}};
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

/// What belongs to the file that was read and not to the picture in it, or is set anew for the one that is written.
bool isOfTheFile(const std::string& name)
{
    static const char* const prefixes[] = {"oiio:", "openexr:", "png:", "tiff:", "jpeg:", "webp:"};
    static const char* const names[] = {"compression", "CompressionQuality", "PixelAspectRatio", "FramesPerSecond",
                                        "chunkCount",  "textureformat",      "planarconfig",     "ResolutionUnit"};
    return std::any_of(std::begin(prefixes), std::end(prefixes), [&](const char* p) { return name.starts_with(p); }) ||
           std::any_of(std::begin(names), std::end(names), [&](const char* n) { return name == n; });
}

ImageColorWords colorWordsOf(const ImageInput& input, const std::string& path, bool isFloat)
{
    const ImageSpec& spec = input.spec();
    ImageColorWords words;
    words.isFloat = isFloat;
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

/// Exif's Orientation, TIFF 6.0 page 36. EXR has no such thing: an attribute of that name is somebody's note.
Orientation orientationOf(const ImageSpec& spec, const std::string& format)
{
    static constexpr Orientation known[] = {{false, false, false}, {false, true, false}, {false, true, true},
                                            {false, false, true},  {true, false, false}, {true, true, false},
                                            {true, true, true},    {true, false, true}};
    const int number = format == "openexr" ? 1 : spec.get_int_attribute("Orientation", 1);
    return number >= 1 && number <= 8 ? known[number - 1] : Orientation{};
}

/// Refuses what a header promises and nothing can hold.
void refuseTooLarge(const ImageSpec& spec, const std::string& path, const ImageHeader& header)
{
    constexpr int farthest = 1 << 30;
    const auto isSane = [](const Window& w) {
        return w.width > 0 && w.height > 0 && w.width <= farthest && w.height <= farthest &&
               std::abs(w.x) <= farthest && std::abs(w.y) <= farthest;
    };
    const double pixels = double(header.data.width) * header.data.height,
                 shown = double(header.display.width) * header.display.height;
    if (!isSane(header.data) || !isSane(header.display))
        throw Error(ErrorCode::Input,
                    "{}: its header says a picture of {}x{} at {}, {} in a frame of {}x{}, which cannot be", path,
                    header.data.width, header.data.height, header.data.x, header.data.y, header.display.width,
                    header.display.height);
    std::error_code error;
    const auto size = double(fs::file_size(path, error));
    // Deflate makes at most 1032 bytes of one (RFC 1951, 258 bytes of 2 bits).
    const double bits = spec.get_int_attribute("oiio:BitsPerSample", int(spec.format.size()) * 8);
    if (!error && header.format == "png" && pixels * bits / 8 > 1032 * size)
        throw Error(ErrorCode::Input, "{}: its header says {}x{} pixels, which its {:.0f} bytes cannot hold", path,
                    header.data.width, header.data.height, size);
    const double needed = pixels * double(spec.pixel_bytes(true)) + shown * 4 * sizeof(float);
    const double there = double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGE_SIZE));
    if (needed > there)
        throw Error(
            ErrorCode::Input,
            "{}: its header says {}x{} pixels in a frame of {}x{}, which take {:.1f} GB; the machine has {:.1f} GB",
            path, header.data.width, header.data.height, header.display.width, header.display.height, needed / 1e9,
            there / 1e9);
}

/// Of the part at which `input` stands.
ImageHeader headerOf(const ImageInput& input, const std::string& path)
{
    const ImageSpec& spec = input.spec();
    ImageHeader header;
    header.format = input.format_name();
    header.data = {spec.x, spec.y, spec.width, spec.height};
    header.display = {spec.full_x, spec.full_y, spec.full_width > 0 ? spec.full_width : spec.width,
                      spec.full_height > 0 ? spec.full_height : spec.height};
    if (spec.nchannels < 1 || spec.width == 0 || spec.height == 0)
        throw Error(ErrorCode::Input, "{}: holds no pixels", path);
    refuseTooLarge(spec, path, header);
    header.orientation = orientationOf(spec, header.format);
    header.width = header.orientation.swap ? header.display.height : header.display.width;
    header.height = header.orientation.swap ? header.display.width : header.display.height;
    header.channelNames = spec.channelnames;
    header.isFloat = spec.format.is_floating_point();
    header.bitDepth = spec.get_int_attribute("oiio:BitsPerSample", int(spec.format.size()) * 8);
    if (header.isFloat || header.bitDepth < 8) header.bitDepth = int(spec.format.size()) * 8;
    header.isStraight = spec.get_int_attribute("oiio:UnassociatedAlpha", 0) != 0 ||
                        (header.format == "webp" && spec.alpha_channel >= 0);
    header.hasAlpha = spec.alpha_channel >= 0;
    header.pixelAspect = spec.get_float_attribute("PixelAspectRatio", 1.0f);
    if (!(header.pixelAspect > 0)) header.pixelAspect = 1;
    if (header.orientation.swap) header.pixelAspect = 1 / header.pixelAspect;
    if (const auto* rate = spec.find_attribute("FramesPerSecond", OIIO::TypeRational)) {
        const int* fraction = static_cast<const int*>(rate->data());
        if (fraction[0] > 0 && fraction[1] > 0) header.fps = double(fraction[0]) / fraction[1];
    }
    header.colorClaims = colorClaims(colorWordsOf(input, path, header.isFloat));
    for (const OIIO::ParamValue& value : spec.extra_attribs) {
        if (isOfTheFile(value.name().string())) continue;
        header.attributes.push_back(toAttribute(value));
        if (header.attributes.back().name == "Orientation" && !header.orientation.isIdentity()) {
            const int upright = 1;
            header.attributes.back().type = "int";
            header.attributes.back().data.resize(sizeof upright);
            std::memcpy(header.attributes.back().data.data(), &upright, sizeof upright);
        }
    }
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
    const std::uintmax_t size = fs::file_size(path, error);
    if (!error && promised != 0xffffffff && promised <= (1u << 31) && size < promised)
        throw Error(ErrorCode::Input, "{}: is cut off: {} of {} bytes are there", path, size, promised);
}

/// Numbers of `count` samples -> floats. Sources are interleaved, `step` bytes apart; targets `toStep` floats.
template <class Number>
void widen(const std::byte* from, std::size_t step, float* to, int toStep, int count, int shift, float scale)
{
    for (int i = 0; i < count; ++i, from += step, to += toStep) {
        Number number;
        std::memcpy(&number, from, sizeof number);
        if constexpr (std::is_integral_v<Number>) number = Number(number >> shift);
        *to = float(number) * scale;
    }
}

/// Channels [first, last) of the part at which `input` stands, over its data window.
ImageF readDataWindow(ImageInput& input, const ImageHeader& header, const std::string& path, int first, int last,
                      bool normalize)
{
    const ImageSpec spec = input.spec();
    const int count = last - first, width = spec.width, height = spec.height;
    if (header.format == "dpx") {
        checkDpxSize(path);
        if (spec.nchannels == 4 && header.bitDepth == 10 && width % 3 == 1)
            throw Error(ErrorCode::Input,
                        "{}: its rows of {} samples of 10 bits end inside a word, of which the last alpha is not read "
                        "rightly; store it in 16 bits",
                        path, 4 * width);
    }
    if (header.format == "webp" && spec.nchannels == 4) {
        const auto codes = readWebpRgba(path, width, height);
        if (!codes) throw Error(ErrorCode::Input, "{}: is damaged or cut off", path);
        ImageF image(width, height, count);
        for (std::size_t i = 0; i < image.size(); ++i) {
            const std::size_t pixel = i / std::size_t(count), channel = i % std::size_t(count) + std::size_t(first);
            image.data()[i] = float((*codes)[4 * pixel + channel]) / (normalize ? 255.0f : 1.0f);
        }
        return image;
    }
    // Floats of both sizes are converted here, so that every bit pattern survives; so are integers that are to stay as
    // they are, and those of fewer bits than their type, which OpenImageIO widens in several ways.
    const bool isNarrow = spec.format == TypeDesc::UINT16 && header.bitDepth > 8 && header.bitDepth < 16;
    const bool isNative = !normalize || header.isFloat || !spec.channelformats.empty() || isNarrow;
    std::vector<std::size_t> offsets;
    std::size_t pixelBytes = 0;
    for (int c = first; c < last; ++c) {
        offsets.push_back(pixelBytes);
        pixelBytes += isNative ? spec.channelformat(c).size() : sizeof(float);
    }
    std::vector<std::byte> raw(std::size_t(width) * std::size_t(height) * pixelBytes);
    // A strip or scanline that is cut off may leave a message alone, with the pixels before it in its place.
    if (!input.read_image(input.current_subimage(), 0, first, last, isNative ? TypeDesc::UNKNOWN : TypeDesc::FLOAT,
                          raw.data()) ||
        input.has_error())
        throw Error(ErrorCode::Input, "{}: is damaged or cut off ({})", path, firstLine(input.geterror()));

    const int shift = isNarrow ? 16 - header.bitDepth : 0;
    ImageF image(width, height, count);
    parallelFor(0, height, rowsPerPiece, [&](std::ptrdiff_t top, std::ptrdiff_t bottom) {
        for (std::ptrdiff_t y = top; y < bottom; ++y)
            for (int c = 0; c < count; ++c) {
                const std::byte* from =
                    raw.data() + std::size_t(y) * std::size_t(width) * pixelBytes + offsets[std::size_t(c)];
                float* to = image.row(int(y)) + c;
                const auto take = [&](auto number, float scale = 1) {
                    widen<decltype(number)>(from, pixelBytes, to, count, width, shift, scale);
                };
                const TypeDesc type = isNative ? spec.channelformat(first + c) : TypeDesc(TypeDesc::FLOAT);
                const float full = normalize ? float((1 << std::min(header.bitDepth, 16)) - 1) : 1;
                switch (type.basetype) {
                    case TypeDesc::FLOAT: take(float()); break;
                    case TypeDesc::DOUBLE: take(double()); break;
                    case TypeDesc::HALF:
                        for (int x = 0; x < width; ++x, from += pixelBytes, to += count) {
                            std::uint16_t bits;
                            std::memcpy(&bits, from, sizeof bits);
                            floatsFromHalves(&bits, to, 1);
                        }
                        break;
                    case TypeDesc::UINT8: take(std::uint8_t()); break;
                    case TypeDesc::INT8: take(std::int8_t()); break;
                    case TypeDesc::UINT16:
                        take(std::uint16_t());
                        if (normalize)  // divided, as a factor would not give every code its nearest float
                            for (int x = 0; x < width; ++x) image.at(x, int(y), c) /= full;
                        break;
                    case TypeDesc::INT16: take(std::int16_t()); break;
                    case TypeDesc::UINT32: take(std::uint32_t()); break;
                    case TypeDesc::INT32: take(std::int32_t()); break;
                    default: throw Error(ErrorCode::Input, "{}: its {} samples are not supported", path, type.c_str());
                }
            }
    });
    return image;
}

/// The display window upright, 0 where there are no data.
ImageF shownOf(ImageF data, const ImageHeader& header)
{
    if (header.data != header.display) {
        ImageF placed(header.display.width, header.display.height, data.channels());
        const Window both = overlap(header.data, header.display);
        for (int y = both.y; y < both.bottom() && both.width > 0; ++y)
            std::copy_n(data.pixel(both.x - header.data.x, y - header.data.y),
                        std::size_t(both.width) * std::size_t(data.channels()),
                        placed.pixel(both.x - header.display.x, y - header.display.y));
        data = std::move(placed);
    }
    if (header.orientation.isIdentity()) return data;
    ImageF upright(header.width, header.height, data.channels());
    orient(data, header.orientation, upright);
    return upright;
}

/// The channels of both.
ImageF beside(const ImageF& a, const ImageF& b)
{
    ImageF both(a.width(), a.height(), a.channels() + b.channels());
    for (int y = 0; y < a.height(); ++y)
        for (int x = 0; x < a.width(); ++x) {
            std::copy_n(a.pixel(x, y), a.channels(), both.pixel(x, y));
            std::copy_n(b.pixel(x, y), b.channels(), both.pixel(x, y) + a.channels());
        }
    return both;
}

PartChannels channelsOf(const ImageSpec& spec)
{
    PartChannels part;
    part.name = spec.get_string_attribute("oiio:subimagename");
    part.view = spec.get_string_attribute("view");
    part.channels = spec.channelnames;
    part.alpha = spec.alpha_channel;
    part.isDeep = spec.deep;
    if (const auto* views = spec.find_attribute("multiView"); views && views->type().basetype == TypeDesc::STRING)
        part.views = toAttribute(*views).strings;
    return part;
}

/// Leaves `input` at the part that the picture is in.
ImageHeader pictureHeaderOf(ImageInput& input, const std::string& path, const PictureChoice& choice)
{
    std::vector<PartChannels> parts = {channelsOf(input.spec())};
    // Elsewhere these are pages, thumbnails and frames of an animation.
    if (std::strcmp(input.format_name(), "openexr") == 0)
        for (int i = 1; input.seek_subimage(i, 0); ++i) parts.push_back(channelsOf(input.spec()));
    if (std::all_of(parts.begin(), parts.end(), [](const PartChannels& p) { return p.isDeep; }))
        throw Error(ErrorCode::Input, "{}: is a deep image, which cannot be read; flatten it first", path);
    const PictureChannels picture = choosePicture(parts, choice, path);
    input.geterror();  // that there is no further part
    if (!input.seek_subimage(picture.part, 0))
        throw Error(ErrorCode::Input, "{}: is damaged or cut off ({})", path, firstLine(input.geterror()));
    const ImageSpec& spec = input.spec();
    ImageHeader header = headerOf(input, path);
    header.picture = picture;
    header.hasAlpha = picture.alpha >= 0;
    header.layers = layersIn(parts);
    header.views = viewsIn(parts);
    header.beside = besidePicture(parts, picture);
    const int channels[] = {picture.red, picture.green, picture.blue, picture.alpha};
    if (!spec.channelformats.empty()) header.bitDepth = 0;
    for (std::size_t i = 0; i < 4; ++i) {
        if (channels[i] < 0) continue;
        header.pictureNames[i] = spec.channelnames[std::size_t(channels[i])];
        const TypeDesc type = spec.channelformat(channels[i]);
        if (type.basetype == TypeDesc::UINT32 || type.basetype == TypeDesc::INT32)
            throw Error(
                ErrorCode::Input,
                "{}: its {} holds whole numbers of 32 bits, which are data and no colours; --layer names another", path,
                header.pictureNames[i]);
        if (!spec.channelformats.empty()) {
            header.isFloat = type.is_floating_point();
            header.bitDepth = std::max(header.bitDepth, int(type.size()) * 8);
        }
    }
    return header;
}

/// Calls read(), and says of what the memory was too small for.
template <class Read>
auto inMemory(const std::string& path, const Read& read)
{
    try {
        return read();
    } catch (const std::bad_alloc&) {
        throw Error(ErrorCode::Input, "{}: its pixels do not fit into memory", path);
    }
}

}  // namespace

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

ImageHeader readImageHeader(const std::string& path)
{
    return inMemory(path, [&] { return headerOf(*open(path), path); });
}

ImageF readAllChannels(const std::string& path, ImageHeader& header, bool normalize)
{
    return inMemory(path, [&] {
        const auto input = open(path);
        header = headerOf(*input, path);
        if (input->spec().deep)
            throw Error(ErrorCode::Input, "{}: is a deep image, which cannot be read; flatten it first", path);
        ImageF all = shownOf(readDataWindow(*input, header, path, 0, input->spec().nchannels, normalize), header);
        for (int i = 1; header.format == "openexr" && input->seek_subimage(i, 0); ++i) {
            const ImageSpec part = input->spec();
            if (part.deep) continue;
            const ImageHeader own = headerOf(*input, path);
            if (own.width != header.width || own.height != header.height) continue;
            all = beside(all, shownOf(readDataWindow(*input, own, path, 0, part.nchannels, normalize), own));
            for (const std::string& name : own.channelNames) {
                const bool isTaken = std::ranges::find(header.channelNames, name) != header.channelNames.end();
                header.channelNames.push_back(
                    isTaken ? part.get_string_attribute("oiio:subimagename").str() + "." + name : name);
            }
            header.isFloat = header.isFloat || own.isFloat;
            header.bitDepth = std::max(header.bitDepth, own.bitDepth);
        }
        return all;
    });
}

ImageHeader readPictureHeader(const std::string& path, const PictureChoice& choice)
{
    return inMemory(path, [&] { return pictureHeaderOf(*open(path), path, choice); });
}

ImageF readCodedRgba(const std::string& path, ImageHeader& header, const PictureChoice& choice, ImageF* overscan)
{
    return inMemory(path, [&] {
        const auto input = open(path);
        header = pictureHeaderOf(*input, path, choice);
        const PictureChannels& c = header.picture;
        const int first = std::min({c.red, c.green, c.blue, c.alpha >= 0 ? c.alpha : c.red});
        const int last = std::max({c.red, c.green, c.blue, c.alpha}) + 1;
        ImageF read = readDataWindow(*input, header, path, first, last, true);
        if (last - first != 4 || c.red != first || c.green != first + 1 || c.blue != first + 2 ||
            c.alpha != first + 3) {
            ImageF rgba(read.width(), read.height(), 4);
            parallelFor(0, read.height(), rowsPerPiece, [&](std::ptrdiff_t top, std::ptrdiff_t bottom) {
                for (std::ptrdiff_t y = top; y < bottom; ++y)
                    for (int x = 0; x < read.width(); ++x) {
                        const float* from = read.pixel(x, int(y)) - first;
                        float* to = rgba.pixel(x, int(y));
                        to[0] = from[c.red];
                        to[1] = from[c.green];
                        to[2] = from[c.blue];
                        to[3] = c.alpha >= 0 ? from[c.alpha] : 1.0f;
                    }
            });
            read = std::move(rgba);
        }
        const bool reachesBeyond = !header.display.contains(header.data);
        if (overscan != nullptr && reachesBeyond && header.orientation.isIdentity()) *overscan = read;
        ImageF shown = shownOf(std::move(read), header);
        if (c.alpha < 0 && !header.data.contains(header.display))  // an opaque picture is so where nothing is, too
            for (int y = 0; y < shown.height(); ++y)
                for (int x = 0; x < shown.width(); ++x) shown.at(x, y, 3) = 1.0f;
        return shown;
    });
}

}  // namespace virga::io
