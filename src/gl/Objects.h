// GL objects that own their name: made in the constructor, deleted in the destructor, movable, never copied. They need
// the Context current (see Context.h). Direct state access throughout: nothing is bound as a side effect.
#pragma once

#include <epoxy/gl.h>

#include <cstddef>
#include <span>
#include <utility>

namespace virga::gl {

/// Storage on the device, of a fixed size.
class Buffer {
public:
    Buffer() = default;
    /// flags as glNamedBufferStorage; 0 is device-only.
    Buffer(std::size_t bytes, GLbitfield flags = GL_DYNAMIC_STORAGE_BIT, const void* data = nullptr);
    ~Buffer();
    Buffer(Buffer&& other) noexcept { swap(other); }
    Buffer& operator=(Buffer&& other) noexcept
    {
        swap(other);
        return *this;
    }

    GLuint name() const { return name_; }
    std::size_t bytes() const { return bytes_; }

    void upload(const void* data, std::size_t bytes, std::size_t offset = 0);
    template <class T>
    void upload(std::span<const T> data)
    {
        upload(data.data(), data.size_bytes());
    }
    void download(void* data, std::size_t bytes, std::size_t offset = 0) const;
    void clear();  ///< all bytes zero

    void bindStorage(GLuint index) const { glBindBufferBase(GL_SHADER_STORAGE_BUFFER, index, name_); }
    void bindUniform(GLuint index) const { glBindBufferBase(GL_UNIFORM_BUFFER, index, name_); }

    /// Makes it at least `bytes` long; what it held is lost when it grows.
    void reserve(std::size_t bytes);

private:
    void swap(Buffer& other) noexcept
    {
        std::swap(name_, other.name_);
        std::swap(bytes_, other.bytes_);
        std::swap(flags_, other.flags_);
    }
    GLuint name_ = 0;
    std::size_t bytes_ = 0;
    GLbitfield flags_ = GL_DYNAMIC_STORAGE_BIT;
};

/// A texture of one, two or three dimensions or an array, of immutable size and format.
class Texture {
public:
    Texture() = default;
    /// 2-D, linear filter, clamped to the edge. internalFormat: GL_RGBA32F, GL_RGBA16F, GL_R32F, ...
    static Texture make2D(GLenum internalFormat, int width, int height, int levels = 1);
    static Texture make3D(GLenum internalFormat, int width, int height, int depth);
    static Texture make2DArray(GLenum internalFormat, int width, int height, int layers, int levels = 1);
    ~Texture();
    Texture(Texture&& other) noexcept { swap(other); }
    Texture& operator=(Texture&& other) noexcept
    {
        swap(other);
        return *this;
    }

    GLuint name() const { return name_; }
    int width() const { return width_; }
    int height() const { return height_; }
    int depth() const { return depth_; }
    GLenum format() const { return format_; }
    std::size_t bytes() const;  ///< of level 0
    explicit operator bool() const { return name_ != 0; }

    /// Whole level 0 from memory: format GL_RGBA, GL_RED, ...; type GL_FLOAT, GL_HALF_FLOAT, ...; rows packed.
    void upload(GLenum format, GLenum type, const void* data);
    void setFilter(GLenum filter);
    void setWrap(GLenum s, GLenum t);
    void makeMipmaps() { glGenerateTextureMipmap(name_); }

    void bind(GLuint unit) const { glBindTextureUnit(unit, name_); }
    void bindImage(GLuint unit, GLenum access) const
    {
        glBindImageTexture(unit, name_, 0, GL_TRUE, 0, access, format_);
    }

private:
    Texture(GLenum target, GLenum format, int width, int height, int depth);
    void swap(Texture& other) noexcept
    {
        std::swap(name_, other.name_);
        std::swap(target_, other.target_);
        std::swap(format_, other.format_);
        std::swap(width_, other.width_);
        std::swap(height_, other.height_);
        std::swap(depth_, other.depth_);
    }
    GLuint name_ = 0;
    GLenum target_ = 0, format_ = 0;
    int width_ = 0, height_ = 0, depth_ = 1;
};

}  // namespace virga::gl
