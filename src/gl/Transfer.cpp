#include "gl/Transfer.h"

#include "core/Error.h"

namespace virga::gl {

MappedBuffer::MappedBuffer(std::size_t bytes, Way way) : bytes_(bytes)
{
    const GLbitfield access =
        (way == Way::ToDevice ? GL_MAP_WRITE_BIT : GL_MAP_READ_BIT) | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
    glCreateBuffers(1, &name_);
    // What comes from the device is read by the processor, so it lies in the processor's memory.
    glNamedBufferStorage(name_, GLsizeiptr(bytes), nullptr,
                         access | (way == Way::FromDevice ? GLbitfield(GL_CLIENT_STORAGE_BIT) : 0u));
    data_ = static_cast<std::uint8_t*>(glMapNamedBufferRange(name_, 0, GLsizeiptr(bytes), access));
    if (data_ != nullptr) return;
    glDeleteBuffers(1, &name_);
    throw Error(ErrorCode::Graphics, "the device cannot map a buffer of {} bytes", bytes);
}

MappedBuffer::~MappedBuffer()
{
    if (name_ != 0) glDeleteBuffers(1, &name_);  // unmaps
}

Fence::~Fence()
{
    if (sync_ != nullptr) glDeleteSync(sync_);
}

void Fence::place()
{
    if (sync_ != nullptr) glDeleteSync(sync_);
    sync_ = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
}

void Fence::wait()
{
    if (sync_ == nullptr) return;
    constexpr GLuint64 second = 1'000'000'000;
    GLenum state = GL_TIMEOUT_EXPIRED;
    while (state == GL_TIMEOUT_EXPIRED) state = glClientWaitSync(sync_, GL_SYNC_FLUSH_COMMANDS_BIT, second);
    glDeleteSync(sync_);
    sync_ = nullptr;
    if (state == GL_WAIT_FAILED) throw Error(ErrorCode::Graphics, "the device does not answer any more");
}

}  // namespace virga::gl
