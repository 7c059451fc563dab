#include "Interrupt.h"

#include <unistd.h>

#include <csignal>

#include "core/Error.h"

namespace virga::cli {
namespace {

volatile std::sig_atomic_t interrupted = 0;

void onInterrupt(int)
{
    if (interrupted != 0) _exit(exitCode(ErrorCode::Interrupted));
    interrupted = 1;
}

}  // namespace

void noteInterrupts()
{
    std::signal(SIGINT, onInterrupt);
    std::signal(SIGTERM, onInterrupt);
}

bool isInterrupted() { return interrupted != 0; }

}  // namespace virga::cli
