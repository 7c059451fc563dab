// How fast a raindrop falls through still air at sea level (20 C, 1013 hPa).
#pragma once

namespace virga::rainfall {

/// Terminal speed [m/s] of a water drop of equivolume diameter `diameter` [m].
///
/// 0.1 to 5.8 mm: a monotone cubic (Fritsch & Carlson 1980) through the 34 measured points of Gunn & Kinzer 1949,
/// "The terminal velocity of fall for water droplets in stagnant air", J. Meteorology 6: 243-248, so the table is met
/// exactly and 0.2 m/s from any smooth curve through it is out of reach. Below: Stokes's law with a drag correction
/// that takes over the table's value and slope at 0.1 mm. Above: relaxes to 9.23 m/s, where drops flatten as fast as
/// they grow, from the table's value and slope at 5.8 mm.
///
/// Smooth (once differentiable) and strictly growing; 0 for diameter <= 0. Does not throw.
double terminalSpeed(double diameter) noexcept;

}  // namespace virga::rainfall
