// WebP with alpha, by libwebp itself: OpenImageIO (2.4) multiplies its 8-bit codes by alpha on the way in, and on the
// way out through a power of them in 8 bits, which leaves nothing of the dark ones.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace virga::io {

/// Straight R G B A codes, rows from the top; nothing if the file cannot be decoded to these sizes.
std::optional<std::vector<std::uint8_t>> readWebpRgba(const std::string& path, int width, int height);

/// quality: 0 to 100; nothing: without loss. The colours under alpha 0 stay. Returns why it could not be written, empty
/// if it was.
[[nodiscard]] std::string writeWebpRgba(const std::string& path, const std::vector<std::uint8_t>& rgba, int width,
                                        int height, std::optional<float> quality);

}  // namespace virga::io
