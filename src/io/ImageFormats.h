// Which image formats there are, by the names of files.
#pragma once

#include <string>
#include <vector>

namespace virga::io {

/// Whether files with this extension are images that can be read (else they may be movies).
bool isImageName(const std::string& path);

/// OpenImageIO's names of the formats that this file may be in: by its extension, then those that are known by their
/// first bytes. Movies are not among them, which OpenImageIO would open through FFmpeg.
std::vector<std::string> formatsToTry(const std::string& path);

/// Name of the format that files called `path` are written in ("openexr"). Throws Error(Output) listing what there is.
std::string imageFormatOf(const std::string& path);
bool formatHasAlpha(const std::string& path);

/// Whether colours stand multiplied by alpha in files of this format, as far as the format decides it: PNG
/// (2003, 12.2), WebP (RFC 9649, 2.7.1.2) and Targa (2.0, the usual attribute type 3) hold them straight; OpenEXR
/// multiplied; SGI, DPX and BMP say nothing and are taken as multiplied, as OpenImageIO does. TIFF holds both.
enum class AlphaKind { Multiplied, Straight, AsTheFileSays };
AlphaKind alphaKindOf(const std::string& format);

}  // namespace virga::io
