#include "io/WebpFile.h"

#include <webp/decode.h>
#include <webp/encode.h>

#include <fstream>
#include <iterator>
#include <memory>

#include "core/Error.h"

namespace virga::io {

std::optional<std::vector<std::uint8_t>> readWebpRgba(const std::string& path, int width, int height)
{
    std::ifstream file(path, std::ios::binary);
    const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
    std::vector<std::uint8_t> rgba(std::size_t(width) * std::size_t(height) * 4);
    int w = 0, h = 0;
    if (WebPGetInfo(bytes.data(), bytes.size(), &w, &h) == 0 || w != width || h != height ||
        WebPDecodeRGBAInto(bytes.data(), bytes.size(), rgba.data(), rgba.size(), 4 * width) == nullptr)
        return std::nullopt;
    return rgba;
}

void writeWebpRgba(const std::string& path, const std::vector<std::uint8_t>& rgba, int width, int height,
                   std::optional<float> quality)
{
    WebPConfig config;
    WebPPicture picture;
    if (WebPConfigInit(&config) == 0 || WebPPictureInit(&picture) == 0)
        throw Error(ErrorCode::Output, "{}: cannot be written (libwebp is of another version)", path);
    const std::unique_ptr<WebPPicture, decltype(&WebPPictureFree)> freePicture(&picture, WebPPictureFree);
    WebPMemoryWriter memory;
    WebPMemoryWriterInit(&memory);
    const std::unique_ptr<WebPMemoryWriter, decltype(&WebPMemoryWriterClear)> freeMemory(&memory,
                                                                                         WebPMemoryWriterClear);
    config.quality = quality.value_or(75);
    config.method = 6;
    config.lossless = quality ? 0 : 1;
    config.exact = 1;
    picture.use_argb = config.lossless;
    picture.width = width;
    picture.height = height;
    picture.writer = WebPMemoryWrite;
    picture.custom_ptr = &memory;
    if (WebPPictureImportRGBA(&picture, rgba.data(), 4 * width) == 0 || WebPEncode(&config, &picture) == 0)
        throw Error(ErrorCode::Output,
                    "{}: cannot be written as WebP (libwebp's error {}; 16383 pixels a side are most)", path,
                    int(picture.error_code));
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(memory.mem), std::streamsize(memory.size));
    file.close();
    if (!file) throw Error(ErrorCode::Output, "{}: cannot be written", path);
}

}  // namespace virga::io
