#include "Controls.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace virga::frei0r {

std::span<const Control> controls()
{
    static constexpr Control all[] = {
        {"rate", "how much rain falls: 0 to 1 is 0 to 200 mm/h; 0.025 is light, 0.125 heavy, 0.4 a downpour", 0.125,
         "rate", 0, 200},
        {"wind", "wind to the right: 0 to 1 is -20 to 20 m/s, 0.5 none", 0.5, "wind", -20, 20},
        {"fog", "extinction of the fog: 0 is that of the drops too far to be drawn, up to 1 is 0 to 0.05 1/m", 0, "fog",
         0, 0.05, false, true},
        {"darkening", "how much light the rainy day takes away, 0 to 1", 0.1, "darken", 0, 1},
        {"seed", "another number, other drops: 0 to 1 is 0 to 1000, whole", 0.001, "seed", 0, 1000, true},
        {"settings",
         "a settings file of 'virga rain --save-settings' (TOML) for everything else; what stands at its default "
         "here is as the file says",
         0, nullptr, 0, 0},
        {"opacity", "of the strokes: 0 to 1 is 0 to 20 times what drops cover; 0.25 is what cameras make of it", 0.25,
         "opacity", 0, 20},
        {"fps", "frames a second, over 1000: 0.025 is 25; 0.023976 is 23.976. Frame n is the one at n / fps seconds",
         0.025, "fps", 0, 1000},
        {"time",
         "what the host counts time in: 0 as it is known to (libavfilter in milliseconds, all others in seconds, as "
         "frei0r asks), 0.5 seconds, 1 milliseconds",
         0, nullptr, 0, 0},
    };
    return all;
}

std::string textOf(const Control& control, double value)
{
    value = std::isfinite(value) ? std::clamp(value, 0.0, 1.0) : control.start;
    if (control.zeroIsAuto && value == 0) return "auto";
    double made = control.least + (control.most - control.least) * value;
    // 0.023976 * 1000 and its like, as they are meant.
    made = control.isWhole ? std::round(made) : std::round(made * 1e9) / 1e9;
    char text[32];
    std::string all(text, std::to_chars(text, text + sizeof text, made).ptr);
    if (control.parameter == std::string("wind")) all += ",0";
    return all;
}

}  // namespace virga::frei0r
