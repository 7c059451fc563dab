#include "gl/Objects.h"

#include "core/Error.h"

namespace virga::gl {

Buffer::Buffer(std::size_t bytes, GLbitfield flags, const void* data) : bytes_(bytes), flags_(flags)
{
    glCreateBuffers(1, &name_);
    glNamedBufferStorage(name_, GLsizeiptr(bytes), data, flags);
}

Buffer::~Buffer()
{
    if (name_ != 0) glDeleteBuffers(1, &name_);
}

void Buffer::upload(const void* data, std::size_t bytes, std::size_t offset)
{
    if (bytes != 0) glNamedBufferSubData(name_, GLintptr(offset), GLsizeiptr(bytes), data);
}

void Buffer::download(void* data, std::size_t bytes, std::size_t offset) const
{
    if (bytes != 0) glGetNamedBufferSubData(name_, GLintptr(offset), GLsizeiptr(bytes), data);
}

void Buffer::clear() { glClearNamedBufferData(name_, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr); }

void Buffer::reserve(std::size_t bytes)
{
    if (bytes > bytes_) *this = Buffer(bytes, flags_);
}

Texture::Texture(GLenum target, GLenum format, int width, int height, int depth)
    : target_(target), format_(format), width_(width), height_(height), depth_(depth)
{
    glCreateTextures(target, 1, &name_);
    glTextureParameteri(name_, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTextureParameteri(name_, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTextureParameteri(name_, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTextureParameteri(name_, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glTextureParameteri(name_, GL_TEXTURE_WRAP_R, GL_CLAMP_TO_EDGE);
}

Texture Texture::make2D(GLenum internalFormat, int width, int height, int levels)
{
    Texture texture(GL_TEXTURE_2D, internalFormat, width, height, 1);
    glTextureStorage2D(texture.name_, levels, internalFormat, width, height);
    return texture;
}

Texture Texture::make3D(GLenum internalFormat, int width, int height, int depth)
{
    Texture texture(GL_TEXTURE_3D, internalFormat, width, height, depth);
    glTextureStorage3D(texture.name_, 1, internalFormat, width, height, depth);
    return texture;
}

Texture Texture::make2DArray(GLenum internalFormat, int width, int height, int layers, int levels)
{
    Texture texture(GL_TEXTURE_2D_ARRAY, internalFormat, width, height, layers);
    glTextureStorage3D(texture.name_, levels, internalFormat, width, height, layers);
    if (levels > 1) glTextureParameteri(texture.name_, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    return texture;
}

Texture::~Texture()
{
    if (name_ != 0) glDeleteTextures(1, &name_);
}

void Texture::upload(GLenum format, GLenum type, const void* data)
{
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    if (target_ == GL_TEXTURE_2D)
        glTextureSubImage2D(name_, 0, 0, 0, width_, height_, format, type, data);
    else
        glTextureSubImage3D(name_, 0, 0, 0, 0, width_, height_, depth_, format, type, data);
}

void Texture::setFilter(GLenum filter)
{
    glTextureParameteri(name_, GL_TEXTURE_MIN_FILTER, GLint(filter));
    glTextureParameteri(name_, GL_TEXTURE_MAG_FILTER, GLint(filter));
}

void Texture::setWrap(GLenum s, GLenum t)
{
    glTextureParameteri(name_, GL_TEXTURE_WRAP_S, GLint(s));
    glTextureParameteri(name_, GL_TEXTURE_WRAP_T, GLint(t));
}

std::size_t Texture::bytes() const
{
    const auto bytesPerTexel = [this]() -> std::size_t {
        switch (format_) {
            case GL_RGBA32F: return 16;
            case GL_RGB32F: return 12;
            case GL_RGBA16F: return 8;
            default: return 4;
        }
    };
    return name_ == 0 ? 0 : bytesPerTexel() * std::size_t(width_) * std::size_t(height_) * std::size_t(depth_);
}

}  // namespace virga::gl
