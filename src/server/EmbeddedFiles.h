// The page's files and the description of the interface, inside the program (cmake/EmbedFiles.cmake).
#pragma once

#include <string_view>

namespace virga::server {

/// "index.html", "page.css", "page.js", "openapi.json"; empty for others.
std::string_view embeddedFile(std::string_view name) noexcept;

}  // namespace virga::server
