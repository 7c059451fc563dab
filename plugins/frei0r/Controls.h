// What a frei0r host turns, numbers from 0 to 1, and what Virga makes of them.
#pragma once

#include <span>
#include <string>

namespace virga::frei0r {

struct Control {
    const char* name;
    const char* explanation;
    double start;  ///< 0 to 1
    /// The table's row that it sets; null for `settings`, `time`.
    const char* parameter;
    double least, most;  ///< what 0 and 1 stand for, in the row's unit
    bool isWhole = false;
    bool zeroIsAuto = false;
};

enum Index { rate, wind, fog, darkening, seed, settings, opacity, framesPerSecond, timeUnit };

/// In the order of Index.
std::span<const Control> controls();

/// The text of virga_shot_set for a control that stands at `value`, which is taken to 0..1; not a number is its start.
std::string textOf(const Control& control, double value);

}  // namespace virga::frei0r
