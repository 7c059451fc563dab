// Data on its way between the processor and the device while both go on: memory that both see, and marks in the stream
// of commands.
#pragma once

#include <epoxy/gl.h>

#include <cstddef>
#include <cstdint>
#include <utility>

namespace virga::gl {

/// A buffer that stays mapped. What is in it belongs to the device from the command that uses it until a Fence after
/// that command has passed.
class MappedBuffer {
public:
    enum class Way { ToDevice, FromDevice };
    MappedBuffer() = default;
    /// Throws Error(Graphics) if the driver has no memory to map.
    MappedBuffer(std::size_t bytes, Way way);
    ~MappedBuffer();
    MappedBuffer(MappedBuffer&& other) noexcept { swap(other); }
    MappedBuffer& operator=(MappedBuffer&& other) noexcept
    {
        swap(other);
        return *this;
    }

    GLuint name() const { return name_; }
    std::size_t bytes() const { return bytes_; }
    std::uint8_t* data() const { return data_; }

private:
    void swap(MappedBuffer& other) noexcept
    {
        std::swap(name_, other.name_);
        std::swap(bytes_, other.bytes_);
        std::swap(data_, other.data_);
    }
    GLuint name_ = 0;
    std::size_t bytes_ = 0;
    std::uint8_t* data_ = nullptr;
};

/// A place in the stream of commands.
class Fence {
public:
    Fence() = default;
    ~Fence();
    Fence(const Fence&) = delete;
    Fence& operator=(const Fence&) = delete;

    /// Here, after the commands given so far.
    void place();
    /// Until the device has done what came before the fence; at once if none is placed. Throws Error(Graphics) if the
    /// device is lost.
    void wait();

private:
    GLsync sync_ = nullptr;
};

}  // namespace virga::gl
