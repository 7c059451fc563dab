#pragma once

#include <cstddef>
#include <optional>

#include "core/PlanarPicture.h"

namespace virga::io {

/// Colours from one space to another, a run of pixels at a time. Straight (not premultiplied) colours; alpha is not
/// seen. Safe to call from several threads.
class ColorTransform {
public:
    virtual ~ColorTransform() = default;
    /// In place, `count` values in each of the three.
    virtual void apply(float* red, float* green, float* blue, std::size_t count) const = 0;
    /// Whether apply() leaves every value as it is, so that nobody need call it.
    virtual bool isIdentity() const { return false; }
    /// The curve between codes and light, whichever way it is gone, if there is no more to it than one power.
    virtual std::optional<PowerCurve> power() const { return std::nullopt; }
};

}  // namespace virga::io
