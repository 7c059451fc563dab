// Compute programs, compiled from shaders/ with a set of defines (a variant).
#pragma once

#include <epoxy/gl.h>

#include <memory>
#include <string>

#include "gl/ShaderSource.h"

namespace virga::gl {

/// Owns the name of a program that is linked.
class LinkedProgram {
public:
    explicit LinkedProgram(GLuint name) : name_(name) {}
    ~LinkedProgram() { glDeleteProgram(name_); }
    LinkedProgram(const LinkedProgram&) = delete;
    LinkedProgram& operator=(const LinkedProgram&) = delete;
    GLuint name() const { return name_; }

private:
    GLuint name_;
};

/// May be shared with others of the same text (SharedContexts.h), so what is set is set before each dispatch.
class Program {
public:
    Program() = default;
    /// The one that SharedContexts of this thread have of the same text; else from the binary that was kept when the
    /// same text was compiled by the same driver of the same device, where there is one and the driver still takes it;
    /// else compiled and linked, and kept. Throws Error(Graphics) with the driver's message, file and line as the
    /// author wrote them.
    Program(const std::string& path, const Defines& defines, const ShaderPlaces& places = {});

    GLuint name() const { return linked_ ? linked_->name() : 0; }
    explicit operator bool() const { return linked_ != nullptr; }
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
    std::shared_ptr<const LinkedProgram> linked_;
};

/// Groups that cover `size` items, `local` to a group.
constexpr GLuint groupsFor(int size, int local) { return GLuint((size + local - 1) / local); }

}  // namespace virga::gl
