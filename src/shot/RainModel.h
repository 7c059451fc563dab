#pragma once

#include "particles/RainField.h"
#include "passes/SharedFrame.h"
#include "rainfall/DropSizes.h"
#include "shot/Settings.h"

namespace virga::shot {

/// The settings' rain as physics: which drops there are, which of them are drawn, what the rest does to the view.
class RainModel {
public:
    /// `first`: the shot's first exposure; `--strokes` scales the density so that it shows about that many.
    /// Throws Error(InvalidArgument) if the settings ask for more strokes than can be drawn.
    RainModel(const Settings& settings, const particles::Exposure& first);

    const particles::RainField& field() const { return field_; }
    const rainfall::DropSizes& sizes() const { return sizes_; }
    particles::Visibility visibility(const particles::Exposure& exposure) const;

    /// How much more than their shadow the undrawn drops take out of a beam: what strokes gain in opacity they gain
    /// too, up to Q = 2, what rain really takes out, its diffraction counted (van de Hulst 1957), and what
    /// meteorological visibility is made of.
    double undrawnEfficiency() const;

    /// Optical depth [1] of the rain that is not drawn one by one, out to `depth_m`.
    double opticalDepth(double depth_m, const particles::Exposure& exposure) const;

    /// Optical depth [1] that thinned strokes leave out, as opaque as strokes are drawn. used: visibility(exposure).
    double veil(double depth_m, const particles::Exposure& exposure, const particles::Visibility& used) const;

    /// Fills what the splash pass needs of the constants.
    void describeSplashes(shared::FrameConstants& constants, const particles::Exposure& exposure,
                          const Settings& settings) const;

private:
    particles::Visibility limitsFor(double focal_px, double exposure_s) const;

    rainfall::DropSizes sizes_;
    particles::Visibility limits_;
    double opacity_, sensorWidth_mm_, fstop_, focus_m_;
    particles::RainField field_;
    double firstFocal_px_, firstExposure_s_, firstThin_;  // a lens that does not zoom needs no other
};

}  // namespace virga::shot
