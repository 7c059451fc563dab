#include "shot/FramePlan.h"

#include <fmt/format.h>

namespace virga::shot {
namespace {

/// For Skips::passes: whatever can run beside what runs does, with nothing to do. Layers are made and given to nobody.
void keepIdlePasses(passes::Features& f)
{
    if (!f.light()) return;
    f.fog = f.blur = f.darken = f.boost = f.lights = f.layers = true;
    f.cameraMotion = f.nearest = f.rain;
    f.splashes = f.depth;
}

}  // namespace

void FramePlan::leaveOut(std::string_view pass, const std::string& why)
{
    for (PlannedPass& planned : passes)
        if (planned.name == pass) planned.runs = false, planned.why = why;
}

FramePlan planFrame(const Settings& s, const Wanted& wanted, bool cameraMoves)
{
    FramePlan plan;
    plan.skips = wanted.skips;
    const auto add = [&](const char* name, bool runs, const std::string& why) {
        plan.passes.push_back({name, runs, why});
        return runs;
    };
    passes::Features& f = plan.features;

    const bool falls = s.rate_mm_h > 0 || s.strokes.has_value();
    const bool hasGeometry = !s.depth.empty() || !s.ground.empty();
    f.rain = falls && s.opacity > 0;
    add("strokes", f.rain,
        !falls          ? "--rate is 0"
        : s.opacity > 0 ? fmt::format("{:g} mm/h", s.rate_mm_h)
                        : "--opacity is 0");

    f.veil = f.rain && s.thin > s.threshold;
    add("thinning", f.veil,
        !f.rain      ? "no strokes"
        : f.veil     ? fmt::format("strokes under --thin {:g}", s.thin)
        : s.thin > 0 ? "--thin is not over --threshold"
                     : "--thin is 0");

    const bool autoFog = !s.fog_1_m.has_value();
    f.fog = autoFog ? falls : *s.fog_1_m > 0;
    add("fog", f.fog,
        autoFog ? (falls ? "the drops that are not drawn" : "--fog is auto and --rate is 0")
                : (f.fog ? fmt::format("--fog {:g} 1/m", *s.fog_1_m) : "--fog is 0"));

    f.splashes = falls && s.splashes > 0 && hasGeometry;
    add("splashes", f.splashes,
        !falls              ? "--rate is 0"
        : !(s.splashes > 0) ? "--splashes is 0"
        : !hasGeometry      ? "no depth and no ground to fall on"
                            : fmt::format("x {:g}", s.splashes));

    f.blur = s.blur_px > 0;
    add("blur", f.blur, f.blur ? fmt::format("{:g} px", s.blur_px) : "--blur is 0");

    f.darken = s.darken > 0 || s.desaturate > 0;
    add("darken", f.darken,
        f.darken ? fmt::format("darken {:g}, desaturate {:g}", s.darken, s.desaturate)
                 : "--darken and --desaturate are 0");
    f.colorTransfer = !s.gradeFrom.empty() && s.gradeAmount > 0;
    add("color-transfer", f.colorTransfer,
        f.colorTransfer       ? fmt::format("from '{}'", s.gradeFrom)
        : s.gradeFrom.empty() ? "no --grade-from"
                              : "--grade-amount is 0");

    // Depth is read only where something looks at it.
    f.depth = hasGeometry && (f.rain || f.fog || f.splashes || f.blur);
    add("depth", f.depth,
        !hasGeometry ? "no --depth and no --ground"
        : f.depth    ? (s.depth.empty() ? "--ground" : "--depth")
                     : "nothing looks at it");

    add("environment", f.light(),
        f.light() ? (s.env.empty() ? "made from the plate" : fmt::format("'{}'", s.env)) : "nothing is lit by it");
    f.lights = !s.lights.empty() && f.light();
    add("lights", f.lights,
        f.lights           ? fmt::format("'{}'", s.lights)
        : s.lights.empty() ? "no --lights"
                           : "nothing is lit by them");
    f.boost = (s.backgroundBoost > 0 || s.paper) && (f.rain || f.splashes);
    add("background-boost", f.boost,
        f.boost ? (s.paper ? "--paper" : fmt::format("{:g}", s.backgroundBoost)) : "--background-boost is 0");

    plan.cameraMoves = cameraMoves && (f.rain || f.splashes || f.fog);
    f.cameraMotion = cameraMoves && f.rain;
    add("camera-motion", plan.cameraMoves,
        plan.cameraMoves ? "--camera"
        : cameraMoves    ? "nothing moves with it"
                         : "the camera stands still");

    f.layers = wanted.layers && f.anything();
    f.nearest = f.layers && f.rain;
    add("layers", f.layers, f.layers ? "--layers" : wanted.layers ? "the beauty is the plate" : "no --layers");
    add("composite", f.anything(), f.anything() ? "" : "every effect is off: the plate passes through");
    if (!plan.skips.passes) keepIdlePasses(f);
    return plan;
}

}  // namespace virga::shot
