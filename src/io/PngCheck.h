// Whether a PNG file is whole, before libpng sees it: OpenImageIO's reader (2.4) lets libpng write its complaints to
// standard error itself; and what OpenImageIO does not tell of it.
#pragma once

#include <array>
#include <optional>
#include <string>

namespace virga::io {

/// What is wrong with the chunks of a PNG file (PNG specification, 5.3): cut off, or with a wrong checksum in a chunk
/// that pictures need. Nothing if they are right, if the file is no PNG by its signature, or if it cannot be read.
std::optional<std::string> damageOfPng(const std::string& path);

/// The chunk cICP of a PNG: primaries, transfer and matrix by the numbers of ITU-T H.273. Nothing if there is none
/// before the pixels, or the file is no PNG.
std::optional<std::array<int, 3>> cicpOfPng(const std::string& path);

/// Whether the file is a PNG that does not say what its numbers mean: no chunk sRGB, gAMA, cHRM, iCCP or cICP before
/// its pixels. OpenImageIO (2.4) calls it sRGB all the same.
bool isPngWithoutColorspace(const std::string& path);

}  // namespace virga::io
