#pragma once

namespace virga::passes {

/// What a shot needs: decides which passes, buffers and shader variants exist (docs/design.md, "Skip").
struct Features {
    bool rain = false;
    bool fog = false;
    bool depth = false;     ///< a depth for each pixel
    bool splashes = false;  ///< needs depth
    bool blur = false;
    bool darken = false;
    bool colorTransfer = false;
    bool boost = false;         ///< background boost
    bool lights = false;        ///< lamps in the scene
    bool layers = false;        ///< rain, splash, fog, plate beside the beauty
    bool cameraMotion = false;  ///< the camera moves while the shutter is open
    bool software = false;      ///< the device is Mesa's software renderer: barriers are dear, atomics are not
    bool nearest = false;       ///< depth and motion of the nearest stroke; needs rain
    bool veil = false;          ///< faint strokes are thinned out, their mean is added to the rain's sums; needs rain

    friend bool operator==(const Features&, const Features&) = default;

    bool light() const { return rain || fog || splashes; }  ///< something shows the light of drops
    bool lowPass() const { return boost || fog; }           ///< something needs the smooth background too
    bool anything() const { return rain || fog || splashes || blur || darken || colorTransfer; }
};

}  // namespace virga::passes
