#include "Errors.h"

#include <exception>
#include <new>
#include <utility>

#include "core/Error.h"

namespace virga::lib {
namespace {

/// Of the exception that is being handled.
Failure described()
{
    try {
        throw;
    } catch (const Error& error) {
        return {virga_error(exitCode(error.code())), error.what()};
    } catch (const std::bad_alloc&) {
        return {VIRGA_ERROR_INTERNAL, "out of memory"};
    } catch (const std::exception& error) {
        return {VIRGA_ERROR_INTERNAL, error.what()};
    } catch (...) {
        return {VIRGA_ERROR_INTERNAL, "unknown error"};
    }
}

}  // namespace

void FailureOfShot::remember(const Failure& failure)
{
    const std::lock_guard lock(mutex_);
    if (first_.code == VIRGA_OK) first_ = failure;
}

virga_error FailureOfShot::take(const char** sentence) noexcept
{
    const std::lock_guard lock(mutex_);
    given_ = std::exchange(first_.sentence, {});
    if (sentence != nullptr) *sentence = given_.c_str();
    return std::exchange(first_.code, VIRGA_OK);
}

Failure& failureOfThread() noexcept
{
    thread_local Failure last;
    return last;
}

virga_error failed(FailureOfShot* shot) noexcept
{
    Failure& last = failureOfThread();
    try {
        last = described();
        if (shot != nullptr) shot->remember(last);
    } catch (...) {  // no memory even for the sentence
        last.code = VIRGA_ERROR_INTERNAL;
        last.sentence.clear();
    }
    return last.code;
}

void needs(const void* pointer, const char* name)
{
    if (pointer == nullptr) throw Error(ErrorCode::InvalidArgument, "{}: must not be NULL", name);
}

}  // namespace virga::lib
