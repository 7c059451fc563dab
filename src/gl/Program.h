// Compute programs, compiled from shaders/ with a set of defines (a variant).
#pragma once

#include <epoxy/gl.h>

#include <string>
#include <utility>

#include "gl/ShaderSource.h"

namespace virga::gl {

class Program {
public:
    Program() = default;
    /// From the binary that was kept when the same text was compiled by the same driver of the same device, where there
    /// is one and the driver still takes it; else compiled and linked, and kept.
    /// Throws Error(Graphics) with the driver's message, file and line as the author wrote them.
    Program(const std::string& path, const Defines& defines, const ShaderPlaces& places = {});
    ~Program();
    Program(Program&& other) noexcept { swap(other); }
    Program& operator=(Program&& other) noexcept
    {
        swap(other);
        return *this;
    }

    GLuint name() const { return name_; }
    explicit operator bool() const { return name_ != 0; }
    /// Sets a plain uniform; a name that this variant does not use is fine.
    void set(const char* uniform, GLuint value) const;

    /// Runs groups x * y * z of the program. The caller places the barriers.
    void dispatch(GLuint x, GLuint y = 1, GLuint z = 1) const;
    /// As dispatch, with the three counts read from `offset` in the buffer bound here.
    void dispatchIndirect(GLuint buffer, std::size_t offset) const;

private:
    void build(const std::string& path, const ShaderSource& source);
    bool takeBinary(const std::string& kept);
    std::string binary() const;
    void swap(Program& other) noexcept { std::swap(name_, other.name_); }
    GLuint name_ = 0;
};

/// Groups that cover `size` items, `local` to a group.
constexpr GLuint groupsFor(int size, int local) { return GLuint((size + local - 1) / local); }

}  // namespace virga::gl
