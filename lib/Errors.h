// Errors of the C interface: what was thrown becomes a code, and a sentence that the thread and the shot remember.
#pragma once

#include <cstring>
#include <mutex>
#include <string>

#include "virga/virga.h"

namespace virga::lib {

/// A failure that somebody may ask for.
struct Failure {
    virga_error code = VIRGA_OK;
    std::string sentence;
};

/// The first failure since it was asked for. Thread-safe.
class FailureOfShot {
public:
    void remember(const Failure& failure);
    /// Forgets it. *sentence, if not null, is valid until the next call.
    virga_error take(const char** sentence) noexcept;

private:
    std::mutex mutex_;
    Failure first_;
    std::string given_;
};

/// Of this thread's last failed call.
Failure& failureOfThread() noexcept;

/// To be called in a catch block. `shot` may be null. Does not throw.
virga_error failed(FailureOfShot* shot) noexcept;

/// Runs `body` for the interface; what it throws is remembered.
template <class Body>
virga_error guarded(FailureOfShot* shot, const Body& body) noexcept
{
    try {
        body();
        return VIRGA_OK;
    } catch (...) {
        return failed(shot);
    }
}

/// The number in an enum that a caller wrote: any may stand there, and reading one that is none of the words is
/// undefined.
template <class Enum>
int numberIn(const Enum& word) noexcept
{
    static_assert(sizeof(Enum) == sizeof(int));
    int number = 0;
    std::memcpy(&number, &word, sizeof number);
    return number;
}

/// Throws Error(InvalidArgument) if it is null. `name` is the interface's.
void needs(const void* pointer, const char* name);

}  // namespace virga::lib
