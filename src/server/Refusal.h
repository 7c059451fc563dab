// An answer other than success, on its way out of the depths of a request.
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>
#include <utility>

#include "core/Error.h"
#include "core/Words.h"

namespace virga::server {

/// Thrown where a request ends: HTTP's status, a code for programs ("not-found"), a sentence for people. Failures of
/// the world come as virga::Error from below and become one of these at the border (refusalOf).
class Refusal : public std::runtime_error {
public:
    template <class... Args>
    Refusal(int status, const char* code, fmt::format_string<Args...> format, Args&&... args)
        : std::runtime_error(onOneLine(fmt::format(format, std::forward<Args>(args)...))), status_(status), code_(code)
    {
    }
    Refusal(const Refusal&) = default;

    int status() const noexcept { return status_; }
    const char* code() const noexcept { return code_; }

private:
    int status_;
    const char* code_;  ///< a literal
};

/// What a client is told of a failure of the world (docs/server.md, "Errors").
inline Refusal refusalOf(const Error& error)
{
    switch (error.code()) {
        case ErrorCode::InvalidArgument: return {400, "invalid-argument", "{}", error.what()};
        case ErrorCode::Input: return {422, "input", "{}", error.what()};
        case ErrorCode::Graphics: return {500, "graphics", "{}", error.what()};
        case ErrorCode::Output: return {507, "output", "{}", error.what()};
        case ErrorCode::Interrupted: return {409, "cancelled", "{}", error.what()};
        case ErrorCode::Internal: break;
    }
    return {500, "internal", "{}", error.what()};
}

}  // namespace virga::server
