#pragma once

namespace virga::environment {

/// Of linear RGB in the primaries of Rec.709.
template <class Rgb>
double luminance(const Rgb& c)
{
    return 0.2126 * double(c[0]) + 0.7152 * double(c[1]) + 0.0722 * double(c[2]);
}

}  // namespace virga::environment
