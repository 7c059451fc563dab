// Shader text before the driver sees it: embedded files, #include, #define, and error messages that name the file and
// line that the author wrote.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/KeptFiles.h"

namespace virga::gl {

struct EmbeddedShader {
    std::string_view path;  ///< below shaders/, e.g. "pass_splat_strokes.comp"
    std::string_view text;
};
std::span<const EmbeddedShader> embeddedShaders();

/// Where shaders come from, and where what a driver makes of them is kept.
struct ShaderPlaces {
    ShaderPlaces() = default;
    ShaderPlaces(std::string shaderFolder) : folder(std::move(shaderFolder)) {}

    std::string folder;  ///< of GLSL files, for developing; empty: those in the binary
    KeptFiles programs;  ///< see Program
};

/// Name and value of a #define; order is kept.
using Defines = std::vector<std::pair<std::string, std::string>>;

struct ShaderSource {
    std::string text;                ///< complete, starts with #version 450 core
    std::vector<std::string> files;  ///< files[k] is source string number k of #line
};

/// Loads `path` with its #include "..." lines (paths below shaders/, each file once) and the defines after #version.
/// Files come from `shaderFolder` if it is not empty (for developing), else from the binary.
/// Throws Error(Graphics) naming a file that does not exist.
ShaderSource loadShader(const std::string& path, const Defines& defines, const std::string& shaderFolder = {});

/// Puts file names into a driver's log: "1(23) : error" and "1:23(5): error" become "pass_x.comp:23: error".
std::string explainShaderLog(const std::string& log, const ShaderSource& source);

}  // namespace virga::gl
