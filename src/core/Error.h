// Failures of the world, as one sentence each. docs/conventions.md, "Errors".
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>
#include <utility>

#include "core/Words.h"

namespace virga {

/// What kind of thing went wrong; decides the exit code of the command line.
enum class ErrorCode {
    Internal,         ///< a fault of ours                              exit 1
    InvalidArgument,  ///< a flag, a setting, a value out of range      exit 2
    Input,            ///< a file that is missing, damaged, of the wrong kind or size   exit 3
    Graphics,         ///< no usable GL device, a shader that does not compile          exit 4
    Output,           ///< folder, permission, space, a format nobody knows             exit 5
    Interrupted,      ///< the user asked to stop                       exit 130
};

/// The process exit code that stands for `code` (docs/conventions.md).
constexpr int exitCode(ErrorCode code) noexcept
{
    switch (code) {
        case ErrorCode::Internal: return 1;
        case ErrorCode::InvalidArgument: return 2;
        case ErrorCode::Input: return 3;
        case ErrorCode::Graphics: return 4;
        case ErrorCode::Output: return 5;
        case ErrorCode::Interrupted: return 130;
    }
    return 1;
}

/// Thrown for every failure of the world. what() is one sentence that names the thing (file, frame, setting), the value
/// and what is allowed. Mistakes in our own code are assertions, not Errors.
class Error : public std::runtime_error {
public:
    /// Names and values come from files, whose control characters could do more to a terminal than end the line. Only
    /// what a shader's compiler says may have several lines.
    Error(ErrorCode code, const std::string& sentence)
        : std::runtime_error(code == ErrorCode::Graphics ? sentence : onOneLine(sentence)), code_(code)
    {
    }

    template <class... Args>
    Error(ErrorCode code, fmt::format_string<Args...> format, Args&&... args)
        : Error(code, fmt::format(format, std::forward<Args>(args)...))
    {
    }

    ErrorCode code() const noexcept { return code_; }

private:
    ErrorCode code_;
};

}  // namespace virga
