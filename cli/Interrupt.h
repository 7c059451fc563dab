#pragma once

namespace virga::cli {

/// From here on the first Ctrl-C (or SIGTERM) is only noted, so that work can end in an orderly way; the second ends
/// the program at once.
void noteInterrupts();
bool isInterrupted();

}  // namespace virga::cli
