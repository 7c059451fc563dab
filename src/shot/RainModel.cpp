#include "shot/RainModel.h"

#include <algorithm>
#include <cmath>

#include "core/Error.h"
#include "rainfall/SizeClasses.h"

namespace virga::shot {
namespace {

constexpr double mostStrokes = 3e7;           // over 2 GB of them
constexpr double leastSplashDiameter = 1e-3;  // smaller drops leave nothing to see [m]
constexpr double splashLife_s = 0.12;
constexpr double splashCell_m = 0.1;
constexpr unsigned splashSubdivisions = 12;  // the coarsest cells are 0.1 m * 2^12 = 410 m
constexpr double splashReach_m = 60;         // beyond it a splash is a fraction of a pixel

/// A rate that is not 0 stands in for the sizes when --strokes asks for strokes at rate 0.
double rateForSizes(const Settings& s) { return s.rate_mm_h > 0 ? s.rate_mm_h : 25; }

particles::RainField fieldOf(const Settings& s, const rainfall::DropSizes& sizes, const particles::Exposure& first,
                             const particles::Visibility& visibility)
{
    const particles::Motion motion({.wind = {s.wind_m_s[0], s.wind_m_s[1]},
                                    .gust = s.gust_m_s,
                                    .turbulence = s.turbulence_m_s,
                                    .speedScale = s.speed,
                                    .seed = std::uint32_t(s.seed)});
    const auto classes = rainfall::makeSizeClasses(sizes);
    const auto seed = std::uint32_t(s.seed);
    particles::RainField field(classes, sizes.slope(), motion, seed);
    // --strokes counts every drop whose stroke is over the threshold, whatever thinning makes of them.
    particles::Visibility unthinned = visibility;
    unthinned.thin = 0;
    const double expected =
        field.expectedStrokes(first.projection, first.duration_s, s.strokes ? unthinned : visibility);
    const double wanted = s.strokes ? *s.strokes : expected;
    if (wanted > mostStrokes)
        throw Error(ErrorCode::InvalidArgument,
                    "--rate {:g} with --threshold {:g} would draw {:.3g} strokes a frame; at most {:.0g} can be drawn: "
                    "raise --threshold or lower --far",
                    s.rate_mm_h, s.threshold, wanted, mostStrokes);
    if (!s.strokes) return field;
    if (expected <= 0)
        throw Error(ErrorCode::InvalidArgument,
                    "--strokes {:g}: no drop of this rain is visible with --near {:g}, --far {:g}, --threshold {:g}",
                    wanted, s.near_m, s.far_m, s.threshold);
    return particles::RainField(classes, sizes.slope(), motion, seed, wanted / expected,
                                particles::RainField::dropsPerCellFor(wanted));
}

particles::Visibility limitsOf(const Settings& s)
{
    if (s.far_m <= s.near_m)
        throw Error(ErrorCode::InvalidArgument, "--far {:g} m must be over --near {:g} m", s.far_m, s.near_m);
    particles::Visibility limits;
    limits.near_m = s.near_m;
    limits.far_m = s.far_m;
    // What the multiplier makes more opaque is seen from farther; at opacity 0 nothing is drawn at all.
    limits.threshold = s.threshold / std::max(s.opacity, 1e-6);
    limits.thin = s.thin / std::max(s.opacity, 1e-6);
    return limits;
}

/// A whole number's place in the device's 32 bits, however large it is.
std::uint32_t lowBits(double whole) { return std::uint32_t(std::int64_t(std::fmod(whole, 0x1p32))); }

}  // namespace

RainModel::RainModel(const Settings& s, const particles::Exposure& first)
    : sizes_(rateForSizes(s), s.dropSize), limits_(limitsOf(s)), opacity_(s.opacity), sensorWidth_mm_(s.sensorWidth_mm),
      fstop_(s.fstop), focus_m_(s.focus_m), field_(fieldOf(s, sizes_, first, limits_)),
      firstFocal_px_(first.projection.fullFocal_px()), firstExposure_s_(first.duration_s),
      firstThin_(field_.thinnableTo(firstFocal_px_, firstExposure_s_, limits_))
{
}

/// The limits, with strokes thinned no more than this lens and exposure allow.
particles::Visibility RainModel::limitsFor(double focal_px, double exposure_s) const
{
    particles::Visibility v = limits_;
    const bool isFirst = focal_px == firstFocal_px_ && exposure_s == firstExposure_s_;
    v.thin = isFirst ? firstThin_ : field_.thinnableTo(focal_px, exposure_s, limits_);
    return v;
}

particles::Visibility RainModel::visibility(const particles::Exposure& exposure) const
{
    particles::Visibility v = limitsFor(exposure.projection.fullFocal_px(), exposure.duration_s);
    v.aperture_m = 1e-3 * sensorWidth_mm_ * exposure.projection.focal_px / exposure.projection.frameWidth_px / fstop_;
    v.focus_m = focus_m_;
    return v;
}

double RainModel::undrawnEfficiency() const { return std::min(opacity_, 2.0); }

double RainModel::opticalDepth(double depth_m, const particles::Exposure& exposure) const
{
    return undrawnEfficiency() * field_.undrawnOpticalDepth(depth_m, exposure.projection.fullFocal_px(),
                                                            exposure.duration_s, limits_, sizes_.extinction(1.0));
}

double RainModel::veil(double depth_m, const particles::Exposure& exposure, const particles::Visibility& used) const
{
    return opacity_ *
           field_.thinnedOpticalDepth(depth_m, exposure.projection.fullFocal_px(), exposure.duration_s, used);
}

void RainModel::describeSplashes(shared::FrameConstants& c, const particles::Exposure& exposure,
                                 const Settings& s) const
{
    const double least = leastSplashDiameter * s.dropSize;
    const double impacts = sizes_.impactsPerAreaAndTime(least) * field_.densityScale() * s.splashes;
    c.splash = {float(impacts * splashCell_m * splashCell_m * splashLife_s), float(splashLife_s), float(s.splashSize),
                0};
    const double slots = (exposure.open_s + 0.5 * exposure.duration_s) / splashLife_s;
    c.splash.w = float(slots - std::floor(slots));
    const double coarse = splashCell_m * double(1u << splashSubdivisions);
    const auto cellOf = [&](double x) { return std::floor(x / coarse); };
    const glm::dvec3& camera = exposure.poseAtOpen.position;
    c.splashGrid = {float(splashCell_m), float(camera.x - cellOf(camera.x) * coarse),
                    float(camera.z - cellOf(camera.z) * coarse), float(exposure.projection.scale)};
    c.splashKey = {std::uint32_t(s.seed), lowBits(cellOf(camera.x)), lowBits(cellOf(camera.z)), 0};
    c.splashTime = {lowBits(std::floor(slots)), splashSubdivisions, 0, 0};
    c.splashDrop = {float(least), float(sizes_.largestDiameter()), float(sizes_.slope()),
                    float(std::min(splashReach_m, s.far_m))};
}

}  // namespace virga::shot
