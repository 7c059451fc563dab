// The knobs between run time and error, and one way to turn each.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "Clip.h"
#include "PictureError.h"
#include "shot/ReferenceRenderer.h"

namespace bench {

/// What came of one value of a knob, on one clip, with one seed.
struct Measured {
    virga::ImageF beauty, effect;  ///< effect: what rain and fog change, beauty - plate
    double ms = 0;                 ///< a frame's rendering, the median of a few
};

struct Knob {
    std::string name, title, unit;
    std::string against;  ///< what the truth is
    std::vector<double> values;
    double standard;         ///< the default, one of them
    bool onFootage = false;  ///< else on the sample street alone
    bool hasSeeds = true;    ///< else another seed is the same picture
    /// Settings of the clip before the knob is turned.
    std::function<void(virga::shot::Settings&)> prepare;
    /// The picture at a value.
    std::function<Measured(const Clip&, virga::shot::Settings, double value)> render;
    /// What it should be. isOneTruth: the same at every value.
    std::function<Measured(const Clip&, virga::shot::Settings, double value)> truth;
    bool isOneTruth = true;
};

std::vector<Knob> knobs();

/// One clip through the renderer or the reference.
Measured renderClip(const Clip& clip, const virga::shot::Settings& settings);
Measured renderTruth(const Clip& clip, const virga::shot::Settings& settings,
                     const virga::shot::ReferenceOptions& options);

}  // namespace bench
