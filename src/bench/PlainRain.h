// Rain over a plain plate, without a shot: any field of drops through the renderer's own passes, timed.
#pragma once

#include <memory>
#include <string>

#include "particles/RainField.h"
#include "shot/PictureRenderer.h"

namespace virga::bench {

struct PlainScene {
    int width = 720, height = 480;
    double fov_deg = 60, exposure_s = 5e-3;
    particles::Visibility visibility{.near_m = 0.5, .far_m = 500, .threshold = 0.002};
    bool environment = false;  ///< fog and depth: a road 1.6 m under the camera, the sky above it
    bool lamps = false;        ///< one
    bool layers = false;       ///< DrawnPicture::rain too
};

/// The sizes of a rate; see particles::RainField.
particles::RainField fieldOfRate(double rate_mm_h, std::uint32_t seed, double densityScale = 1, double dropsPerCell = 32,
                                 int classes = rainfall::SizeClassOptions{}.count);

/// Drops of one diameter alone [m], so many that `scene` shows about `strokes` of them.
particles::RainField fieldOfSize(double diameter, const PlainScene& scene, double strokes, std::uint32_t seed);

class PlainRain {
public:
    /// Throws Error(Graphics) if the device cannot be had (shot/PictureRenderer.h).
    PlainRain(const PlainScene& scene, const matte::StrokeAtlas& atlas, const std::string& device = "cpu");

    struct Frame {
        shot::DrawnPicture picture;
        double cells_ms = 0;     ///< listing the cells
        double all_ms = 0;       ///< that and rendering
        std::size_t listed = 0;  ///< drops in the cells
        /// Of a pass; 0 if it was not run.
        double passMs(const std::string& name) const;
    };
    /// frame: of 24 a second.
    Frame render(const particles::RainField& field, int frame = 0);

    std::string device() const { return renderer_->device(); }

private:
    PlainScene scene_;
    ImageF depth_;
    std::unique_ptr<shot::PictureRenderer> renderer_;
};

particles::Exposure exposureOf(const PlainScene& scene, int frame);

/// The middle one; the upper of two. 0 of none.
double medianOf(std::vector<double> values);

}  // namespace virga::bench
