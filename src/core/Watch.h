// How long work tells how far it is, and is told to end.
#pragma once

#include <functional>

#include "core/Error.h"

namespace virga {

/// Told, on the thread that asked for the work, what share of it is done, 0 to 1. False: nobody wants it any longer.
/// May be empty.
using Watch = std::function<bool(double)>;

/// Throws Error(Interrupted) if the watch says that nobody wants the work any longer.
inline void tell(const Watch& watch, double done)
{
    if (watch && !watch(done)) throw Error(ErrorCode::Interrupted, "the frame is wanted no longer");
}

}  // namespace virga
