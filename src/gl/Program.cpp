#include "gl/Program.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <vector>

#include "core/Counters.h"
#include "core/Error.h"
#include "gl/SharedContexts.h"

namespace virga::gl {

namespace {

/// All that a program's binary depends on.
std::string keyOf(const ShaderSource& source)
{
    std::string key;
    for (const GLenum name : {GL_VENDOR, GL_RENDERER, GL_VERSION}) {
        const GLubyte* text = glGetString(name);
        key += text != nullptr ? reinterpret_cast<const char*>(text) : "";
        key += '\n';
    }
    return key + source.text;
}

}  // namespace

Program::Program(const std::string& path, const Defines& defines, const ShaderPlaces& places)
{
    constexpr const char* kind = "program";
    const ShaderSource source = loadShader(path, defines, places.folder);
    const std::string key = keyOf(source);
    SharedContexts* const shared = SharedContexts::ofThread();
    if (shared != nullptr && (linked_ = shared->program(key))) return;
    ++counters().programs;
    const std::optional<std::string> kept = places.programs.load(kind, key);
    if (!kept || !takeBinary(*kept)) {
        build(path, source);
        if (const std::string made = binary(); !made.empty()) places.programs.store(kind, key, made);
    }
    if (shared != nullptr) shared->keep(key, linked_);
}

/// The format and then the bytes, as the driver gives them; empty if it gives none.
std::string Program::binary() const
{
    GLint formats = 0, bytes = 0;
    glGetIntegerv(GL_NUM_PROGRAM_BINARY_FORMATS, &formats);
    if (formats == 0) return {};
    glGetProgramiv(name(), GL_PROGRAM_BINARY_LENGTH, &bytes);
    if (bytes <= 0) return {};
    std::string all(sizeof(GLenum) + std::size_t(bytes), '\0');
    GLenum format = 0;
    GLsizei length = 0;
    glGetProgramBinary(name(), bytes, &length, &format, all.data() + sizeof format);
    if (length <= 0) return {};
    std::memcpy(all.data(), &format, sizeof format);
    all.resize(sizeof format + std::size_t(length));
    return all;
}

/// False if this driver does not take it.
bool Program::takeBinary(const std::string& kept)
{
    GLenum format = 0;
    GLint formats = 0, ok = 0;
    glGetIntegerv(GL_NUM_PROGRAM_BINARY_FORMATS, &formats);
    if (kept.size() <= sizeof format || formats == 0) return false;
    std::memcpy(&format, kept.data(), sizeof format);
    // What is no format of its is an error to a driver, and errors are read later, elsewhere.
    std::vector<GLint> known(std::size_t(formats), 0);
    glGetIntegerv(GL_PROGRAM_BINARY_FORMATS, known.data());
    if (std::find(known.begin(), known.end(), GLint(format)) == known.end()) return false;
    const auto taken = std::make_shared<const LinkedProgram>(glCreateProgram());
    glProgramBinary(taken->name(), format, kept.data() + sizeof format, GLsizei(kept.size() - sizeof format));
    glGetProgramiv(taken->name(), GL_LINK_STATUS, &ok);
    if (ok) linked_ = taken;
    return ok != 0;
}

void Program::build(const std::string& path, const ShaderSource& source)
{
    const char* text = source.text.c_str();
    const GLuint shader = glCreateShader(GL_COMPUTE_SHADER);
    glShaderSource(shader, 1, &text, nullptr);
    glCompileShader(shader);
    GLint ok = 0, length = 0;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
    if (!ok) {
        glGetShaderiv(shader, GL_INFO_LOG_LENGTH, &length);
        std::string log(std::size_t(length) + 1, '\0');
        glGetShaderInfoLog(shader, length, nullptr, log.data());
        glDeleteShader(shader);
        throw Error(ErrorCode::Graphics, "shader '{}' does not compile on this device: {}", path,
                    explainShaderLog(log, source));
    }
    const auto made = std::make_shared<const LinkedProgram>(glCreateProgram());
    const GLuint name = made->name();
    glProgramParameteri(name, GL_PROGRAM_BINARY_RETRIEVABLE_HINT, GL_TRUE);
    glAttachShader(name, shader);
    glLinkProgram(name);
    glDeleteShader(shader);
    glGetProgramiv(name, GL_LINK_STATUS, &ok);
    if (!ok) {
        glGetProgramiv(name, GL_INFO_LOG_LENGTH, &length);
        std::string log(std::size_t(length) + 1, '\0');
        glGetProgramInfoLog(name, length, nullptr, log.data());
        throw Error(ErrorCode::Graphics, "shader '{}' does not link on this device: {}", path,
                    explainShaderLog(log, source));
    }
    linked_ = made;
}

void Program::set(const char* uniform, GLuint value) const
{
    glProgramUniform1ui(name(), glGetUniformLocation(name(), uniform), value);
}

void Program::dispatch(GLuint x, GLuint y, GLuint z) const
{
    glUseProgram(name());
    glDispatchCompute(x, y, z);
}

void Program::dispatchIndirect(GLuint buffer, std::size_t offset) const
{
    glUseProgram(name());
    glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, buffer);
    glDispatchComputeIndirect(GLintptr(offset));
}

}  // namespace virga::gl
