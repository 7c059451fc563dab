// The parameter table in C's types, and settings as numbers.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "shot/Parameters.h"
#include "virga/virga.h"

namespace virga::lib {

/// Made once; rows live as long as the library.
std::span<const virga_parameter> table();

/// None for "auto". Throws Error(InvalidArgument) for texts.
std::vector<double> numbersOf(const shot::Settings& settings, const shot::Parameter& parameter);
/// As setFromText. Throws Error(InvalidArgument) for texts, and for as many numbers as the parameter does not take.
void setFromNumbers(shot::Settings& settings, const shot::Parameter& parameter, std::span<const double> numbers);

}  // namespace virga::lib
