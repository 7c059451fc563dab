// The footage that `virga bench curves` solves, for the tests of what solves it.
#pragma once

#include "bench/DrawnRain.h"

namespace virga::test {
using bench::DrawnRain;
using bench::DrawnRainOptions;
using bench::drawRain;
}  // namespace virga::test
