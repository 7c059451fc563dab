#include "gl/ShaderSource.h"

#include <algorithm>
#include <fstream>
#include <regex>
#include <sstream>

#include "core/Error.h"

namespace virga::gl {
namespace {

std::string readShaderFile(const std::string& path, const std::string& shaderFolder)
{
    if (!shaderFolder.empty()) {
        std::ifstream file(shaderFolder + "/" + path);
        if (!file) throw Error(ErrorCode::Graphics, "shader '{}' is not in the shader folder '{}'", path, shaderFolder);
        std::ostringstream text;
        text << file.rdbuf();
        return text.str();
    }
    for (const EmbeddedShader& shader : embeddedShaders())
        if (shader.path == path) return std::string(shader.text);
    throw Error(ErrorCode::Graphics, "shader '{}' is not in this build", path);
}

void append(ShaderSource& source, const std::string& path, const std::string& shaderFolder)
{
    if (std::find(source.files.begin(), source.files.end(), path) != source.files.end()) return;
    const std::size_t fileNumber = source.files.size();
    source.files.push_back(path);
    source.text += "#line 1 " + std::to_string(fileNumber) + "\n";

    std::istringstream lines(readShaderFile(path, shaderFolder));
    std::string line;
    static const std::regex include(R"(^\s*#include\s+"([^"]+)\"\s*$)");
    for (int number = 1; std::getline(lines, line); ++number) {
        std::smatch match;
        if (std::regex_match(line, match, include)) {
            append(source, match[1], shaderFolder);
            source.text += "#line " + std::to_string(number + 1) + " " + std::to_string(fileNumber) + "\n";
        } else {
            source.text += line + "\n";
        }
    }
}

}  // namespace

ShaderSource loadShader(const std::string& path, const Defines& defines, const std::string& shaderFolder)
{
    ShaderSource source;
    source.text = "#version 450 core\n";
    for (const auto& [name, value] : defines) source.text += fmt::format("#define {} {}\n", name, value);
    append(source, path, shaderFolder);
    return source;
}

std::string explainShaderLog(const std::string& log, const ShaderSource& source)
{
    // NVIDIA writes "file(line) : ", Mesa "file:line(column): ".
    static const std::regex place(R"((^|\n)(\d+)[:(](\d+)(\)|\(\d+\))\s*:\s*)");
    std::string explained;
    auto rest = log.cbegin();
    std::smatch match;
    while (std::regex_search(rest, log.cend(), match, place)) {
        const std::size_t file = std::stoul(match[2]);
        explained.append(rest, match[0].first);
        explained += match[1].str() + (file < source.files.size() ? source.files[file] : match[2].str()) + ":" +
                     match[3].str() + ": ";
        rest = match[0].second;
    }
    return explained.append(rest, log.cend());
}

}  // namespace virga::gl
