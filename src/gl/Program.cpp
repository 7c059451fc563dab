#include "gl/Program.h"

#include "core/Error.h"

namespace virga::gl {

Program::Program(const std::string& path, const Defines& defines, const std::string& shaderFolder)
{
    const ShaderSource source = loadShader(path, defines, shaderFolder);
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
    name_ = glCreateProgram();
    glAttachShader(name_, shader);
    glLinkProgram(name_);
    glDeleteShader(shader);
    glGetProgramiv(name_, GL_LINK_STATUS, &ok);
    if (!ok) {
        glGetProgramiv(name_, GL_INFO_LOG_LENGTH, &length);
        std::string log(std::size_t(length) + 1, '\0');
        glGetProgramInfoLog(name_, length, nullptr, log.data());
        glDeleteProgram(std::exchange(name_, 0));
        throw Error(ErrorCode::Graphics, "shader '{}' does not link on this device: {}", path,
                    explainShaderLog(log, source));
    }
}

Program::~Program()
{
    if (name_ != 0) glDeleteProgram(name_);
}

void Program::set(const char* uniform, GLuint value) const
{
    glProgramUniform1ui(name_, glGetUniformLocation(name_, uniform), value);
}

void Program::dispatch(GLuint x, GLuint y, GLuint z) const
{
    glUseProgram(name_);
    glDispatchCompute(x, y, z);
}

void Program::dispatchIndirect(GLuint buffer, std::size_t offset) const
{
    glUseProgram(name_);
    glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, buffer);
    glDispatchComputeIndirect(GLintptr(offset));
}

}  // namespace virga::gl
