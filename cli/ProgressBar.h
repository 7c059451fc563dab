#pragma once

#include "shot/RainJob.h"

namespace virga::cli {

/// Frame, frames a second and time left on standard error: a bar that redraws itself on a terminal, now and then a
/// plain line elsewhere.
class ProgressBar {
public:
    explicit ProgressBar(bool silent);
    ~ProgressBar();
    void show(const shot::Progress& progress);

private:
    bool silent_, terminal_;
    bool drawn_ = false;
    double lastShown_ = -1e9;  // [s]
};

}  // namespace virga::cli
