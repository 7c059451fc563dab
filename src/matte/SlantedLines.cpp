#include "matte/SlantedLines.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace virga::matte {

SlantedLines::SlantedLines(int width, int height, double slant)
    : width_(width), acrossRows_(std::abs(slant) > std::numbers::pi / 4.0)
{
    across_ = acrossRows_ ? height : width;
    length_ = acrossRows_ ? width : height;
    const double major = acrossRows_ ? std::sin(slant) : std::cos(slant);
    const double aside = (acrossRows_ ? std::cos(slant) : std::sin(slant)) / major;  // a step
    stepScale_ = major * major;
    shift_.resize(std::size_t(length_));
    for (int i = 0; i < length_; ++i) shift_[std::size_t(i)] = int(std::lround(aside * i));
    const auto [least, most] = std::minmax_element(shift_.begin(), shift_.end());
    first_ = -*most;
    count_ = across_ + *most - *least;
}

}  // namespace virga::matte
