#include "io/ImageFormats.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "core/Error.h"
#include "core/Words.h"

namespace virga::io {

namespace {

std::string extensionOf(const std::string& path)
{
    const std::string extension = std::filesystem::path(path).extension().string();
    return lowerCase(extension.empty() ? extension : extension.substr(1));
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

std::vector<std::string> formatsToTry(const std::string& path)
{
    std::vector<std::string> formats;
    const auto found = formatsByExtension().find(extensionOf(path));
    if (found != formatsByExtension().end()) formats.push_back(found->second);
    for (const char* format : {"openexr", "png", "jpeg", "tiff", "dpx", "hdr", "webp", "bmp", "sgi", "pnm", "cineon",
                               "jpeg2000", "gif", "psd", "rla", "softimage"})
        if (std::find(formats.begin(), formats.end(), format) == formats.end()) formats.push_back(format);
    return formats;
}

std::string imageFormatOf(const std::string& path)
{
    const std::string* format = writtenFormat(extensionOf(path));
    if (format == nullptr || !OIIO::ImageOutput::create(*format)) {
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
    const auto output = OIIO::ImageOutput::create(imageFormatOf(path));
    return output && output->supports("alpha") != 0;
}

AlphaKind alphaKindOf(const std::string& format)
{
    if (format == "png" || format == "webp" || format == "targa") return AlphaKind::Straight;
    return format == "tiff" ? AlphaKind::AsTheFileSays : AlphaKind::Multiplied;
}

}  // namespace virga::io
