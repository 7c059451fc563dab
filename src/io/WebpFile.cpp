#include "io/WebpFile.h"

#include <fmt/format.h>
#include <webp/decode.h>
#include <webp/encode.h>

#include <fstream>
#include <iterator>
#include <memory>

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

std::string writeWebpRgba(const std::string& path, const std::vector<std::uint8_t>& rgba, int width, int height,
                          std::optional<float> quality)
{
    WebPConfig config;
    WebPPicture picture;
    if (WebPConfigInit(&config) == 0 || WebPPictureInit(&picture) == 0) return "libwebp is of another version";
    const std::unique_ptr<WebPPicture, decltype(&WebPPictureFree)> freePicture(&picture, WebPPictureFree);
    WebPMemoryWriter memory;
    WebPMemoryWriterInit(&memory);
    const std::unique_ptr<WebPMemoryWriter, decltype(&WebPMemoryWriterClear)> freeMemory(&memory,
                                                                                         WebPMemoryWriterClear);
    if (width > WEBP_MAX_DIMENSION || height > WEBP_MAX_DIMENSION)
        return fmt::format("{}x{} pixels; WebP has {} a side at most", width, height, WEBP_MAX_DIMENSION);
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
        return fmt::format("libwebp's error {}", int(picture.error_code));
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(memory.mem), std::streamsize(memory.size));
    file.close();
    return file ? "" : "it cannot be written to";
}

}  // namespace virga::io
