// A knob between run time and error: what it can be set to, what is measured at each setting, and which one users get.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bench/Clip.h"
#include "core/Image.h"

namespace virga::bench {

/// What came of one setting, on one clip, with one seed.
struct Point {
    std::string clip;             ///< or whatever the knob was measured on
    std::string variant = {};     ///< of a second knob; empty: that is at its default
    std::optional<double> value;  ///< nothing: the base line (Knob::baseline)
    std::int64_t seed = 1;
    double ms = 0;               ///< Knob::timed
    std::vector<double> errors;  ///< as many as Knob::measures
};

/// A number that tells how far off a setting is.
struct Measure {
    std::string name;     ///< heading and column: "rmse"
    std::string meaning;  ///< with the unit: "RMSE over the plate's mean"
};

/// Takes what a knob's measurement finds.
class Record {
public:
    virtual ~Record() = default;
    virtual void point(const Point& point) = 0;
    /// For the page; scene-linear, 3 channels or more. Pictures of one clip stand side by side, in the order given.
    virtual void picture(const std::string& clip, const std::string& caption, const ImageF& pixels) = 0;
};

/// What knobs are measured on.
struct Surroundings {
    std::vector<Clip> clips;  ///< the sample first
    int seeds = 3;            ///< 1, 2, ... this
};

struct Knob {
    std::string name, title;
    std::string unit = {};  ///< of the value
    std::string against;    ///< what the truth is
    std::string timed = "a frame's rendering by the processor, the median of five";
    std::vector<double> values;
    double standard = 0;               ///< the default, one of the values; with a standardVariant not looked at
    std::string standardVariant = {};  ///< the variant that is the default, at the one value that it has
    std::vector<Measure> measures;     ///< the first one is charted against time
    std::string baseline = {};         ///< what Points without a value are; empty: there are none
    /// Measures at knob.values (which may be fewer than the knob was made with).
    std::function<void(const Knob& knob, const Surroundings&, Record&)> measure;
};

/// Whether it is the default that came out as this variant at this value.
bool isStandard(const Knob& knob, const std::string& variant, const std::optional<double>& value);

std::vector<Knob> pictureKnobs();     ///< threshold, strokes, env-order, blur, layers
std::vector<Knob> rainKnobs();        ///< size-classes, cell-size
std::vector<Knob> strokeKnobs();      ///< coverage, mattes, stacking
std::vector<Knob> lightKnobs();       ///< light-order, light-map, env-projection, fog-table
std::vector<Knob> extractionKnobs();  ///< extract-tolerance, extract-rounds, extract-pyramid

/// All of them, in the order of the page.
std::vector<Knob> allKnobs();

}  // namespace virga::bench
