#include "ProgressBar.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>

namespace virga::cli {
namespace {

constexpr double redrawEvery_s = 0.1, lineEvery_s = 5;

std::string clockText(double seconds)
{
    const long whole = std::lround(seconds);
    return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

}  // namespace

ProgressBar::ProgressBar(bool silent) : silent_(silent), terminal_(isatty(STDERR_FILENO) != 0) {}

ProgressBar::~ProgressBar()
{
    if (drawn_ && terminal_) std::fputc('\n', stderr);
}

void ProgressBar::show(const shot::Progress& p)
{
    const bool last = p.done == p.total;
    if (silent_ || (!last && p.seconds - lastShown_ < (terminal_ ? redrawEvery_s : lineEvery_s))) return;
    lastShown_ = p.seconds;
    drawn_ = true;
    const double fps = p.seconds > 0 ? double(p.done) / p.seconds : 0;
    const double left = fps > 0 ? double(p.total - p.done) / fps : 0;
    const std::string text =
        fmt::format("frame {} ({} of {}), {:.1f} fps, {} left", p.frame, p.done, p.total, fps, clockText(left));
    if (!terminal_) {
        std::fprintf(stderr, "virga: %s\n", text.c_str());
        return;
    }
    constexpr std::size_t width = 24;
    const std::size_t full = width * p.done / p.total;
    std::fprintf(stderr, "\r[%s%s] %s\033[K", std::string(full, '#').c_str(), std::string(width - full, '.').c_str(),
                 text.c_str());
    std::fflush(stderr);
}

}  // namespace virga::cli
