#include "reference/DropPaths.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <numbers>

#include "core/Error.h"
#include "particles/CellHash.h"

namespace virga::reference {
namespace {

/// A threshold that every drop reaches, and whose visible depth is still a float.
constexpr double noThreshold = 1e-30;
/// Cells are listed for a view wider than the picture by this, so that a cell that the renderer leaves out, and should
/// not have, shows as a difference [rad].
constexpr double widerBy = 0.05;

}  // namespace

double drawnDepth(double diameter_m, double path_m, double focal_px, double threshold)
{
    const double b = focal_px * path_m, c = std::numbers::pi / 4 * std::pow(focal_px * diameter_m, 2) / threshold;
    return 2 * c / (b + std::sqrt(b * b + 4 * c));
}

double thinnedShare(double diameter_m, double path_m, double focal_px, double depth_m, double thin)
{
    if (!(thin > 0)) return 1;
    const double pixels = std::numbers::pi / 4 * std::pow(focal_px * diameter_m / depth_m, 2);
    return std::min(1.0, pixels / (1 + focal_px * path_m / depth_m) / thin);
}

double DropPath::length_px() const
{
    double sum = 0;
    for (int i = 1; i < moments; ++i) sum += glm::distance(at[std::size_t(i - 1)].px, at[std::size_t(i)].px);
    return sum;
}

DropPaths::DropPaths(const Scene& scene) : scene_(scene)
{
    const particles::Exposure& exposure = scene.exposure;
    const particles::RainField& field = *scene.rain.field;
    particles::Visibility listed = scene.rain.visibility;
    if (scene.rain.allDrops) {
        listed.threshold = noThreshold;
        listed.thin = 0;
    }
    const double expected = field.expectedStrokes(exposure.projection, exposure.duration_s, listed);
    if (expected > mostDrops)
        throw Error(ErrorCode::InvalidArgument,
                    "--reference: {:.2g} drops fall in view within --far {:g} m, at most {:.0g} can be drawn one by "
                    "one; lower --far to {:.2g}",
                    expected, listed.far_m, mostDrops, listed.far_m * std::cbrt(0.9 * mostDrops / expected));
    particles::Exposure wider = exposure;
    const int by_px = int(widerBy * exposure.projection.focal_px);
    wider.projection =
        camera::partOf(exposure.projection, 1,
                       {-by_px, -by_px, exposure.projection.width + 2 * by_px, exposure.projection.height + 2 * by_px});
    list_ = field.cellsInView(wider, listed);

    const glm::dquat open = glm::quat_cast(exposure.poseAtOpen.worldFromCamera),
                     close = glm::quat_cast(exposure.poseAtClose.worldFromCamera);
    const glm::dvec3 cameraWay = exposure.poseAtClose.position - exposure.poseAtOpen.position;
    for (int n = 0; n < DropPath::most; ++n) {
        Step& step = steps_[std::size_t(n)];
        const double share = double(n) / (DropPath::most - 1), time = share * exposure.duration_s;
        step.classes = list_.classes;
        for (std::size_t c = 0; c < step.classes.size(); ++c) {
            const double speed = field.classOf(c).speed;
            const glm::dvec3 way = field.motion().displacement(speed, exposure.open_s + time) -
                                   field.motion().displacement(speed, exposure.open_s) - share * cameraWay;
            step.classes[c].travel = glm::vec4(glm::vec3(way), step.classes[c].travel.w);
        }
        step.waves = field.motion().turbulenceWaves(time);
        step.cameraFromWorld = glm::transpose(glm::mat3_cast(glm::slerp(open, close, share)));
        step.focal_px = (1 - share) * exposure.projection.focal_px + share * scene.focalAtClose_px;
    }
}

DropPath::Moment DropPaths::momentOf(std::size_t cell, std::uint32_t index, int n) const
{
    const shared::Cell& c = list_.cells[cell];
    const Step& step = steps_[std::size_t(n)];
    const auto& w = step.waves;
    const shared::Drop drop = shared::dropInCell(c, step.classes[c.key.z], w[0], w[1], w[2], w[3], index);
    DropPath::Moment moment;
    moment.fromCamera = glm::dvec3(drop.close);
    const glm::dvec3 inCamera = step.cameraFromWorld * moment.fromCamera;
    moment.depth = -inCamera.z;
    moment.focal_px = step.focal_px;
    camera::Projection picture = scene_.exposure.projection;
    picture.focal_px = step.focal_px;
    moment.px = camera::project(picture, inCamera).px;
    return moment;
}

bool DropPaths::follow(std::size_t cell, std::uint32_t index, DropPath& path) const
{
    const shared::Cell& c = list_.cells[cell];
    constexpr int last = DropPath::most - 1;
    path.at[0] = momentOf(cell, index, 0);
    path.at[1] = momentOf(cell, index, last);
    const particles::Visibility& visibility = scene_.rain.visibility;
    const double from = std::max(path.at[0].depth, visibility.near_m),
                 to = std::max(path.at[1].depth, visibility.near_m), middle = 0.5 * (from + to);
    const bool crosses = std::min(path.at[0].depth, path.at[1].depth) < visibility.near_m;
    if (std::max(path.at[0].depth, path.at[1].depth) < visibility.near_m || middle > visibility.far_m) return false;

    const auto& w = steps_[0].waves;
    const shared::DropClass& dropClass = list_.classes[c.key.z];
    const shared::Drop drop = shared::dropInCell(c, dropClass, w[0], w[1], w[2], w[3], index);
    path.diameter = double(drop.diameter);
    path.look = drop.look;
    path.standsFor = 1;
    if (!scene_.rain.allDrops) {
        const double way = double(dropClass.travel.w) * scene_.exposure.duration_s,
                     focal = scene_.exposure.projection.fullFocal_px();
        if (middle > drawnDepth(path.diameter, way, focal, visibility.threshold)) return false;
        const double share = thinnedShare(path.diameter, way, focal, middle, visibility.thin);
        if (double(drop.rank) >= share * share) return false;
        path.standsFor = 1 / share;
    }

    path.id = particles::mix((std::uint64_t(c.key.y) << 32 | c.key.x) ^ particles::mix(index + 1));
    path.moments = 2;
    path.shown = 1;
    if (!crosses && glm::distance(path.at[0].px, path.at[1].px) < 2) return true;
    path.at[last] = path.at[1];
    for (int n = 1; n < last; ++n) path.at[std::size_t(n)] = momentOf(cell, index, n);
    path.moments = DropPath::most;
    if (crosses) leaveOutNearer(path);
    return true;
}

/// Its moments become those of the longest part of its way that is beyond the near limit. (Turbulence could bring a
/// drop across more than once, by millimetres.)
void DropPaths::leaveOutNearer(DropPath& path) const
{
    constexpr int last = DropPath::most - 1;
    const double near = scene_.rain.visibility.near_m;
    const auto isBeyond = [&](int n) { return path.at[std::size_t(n)].depth >= near; };
    // Where it crosses, between which two moments.
    const bool beginsBeyond = isBeyond(0);
    int n = 1;
    while (n < last && isBeyond(n) == beginsBeyond) ++n;
    const DropPath::Moment &a = path.at[std::size_t(n - 1)], &b = path.at[std::size_t(n)];
    const double crossing = (n - 1 + (near - a.depth) / (b.depth - a.depth)) / last;
    const double first = beginsBeyond ? 0 : crossing, end = beginsBeyond ? crossing : 1;
    path.shown = end - first;

    const auto before = path.at;
    for (int i = 0; i <= last; ++i) {
        const double place = (first + (end - first) * i / last) * last;
        const int k = std::min(int(place), last - 1);
        const DropPath::Moment &from = before[std::size_t(k)], &to = before[std::size_t(k + 1)];
        const double f = place - k;
        DropPath::Moment& moment = path.at[std::size_t(i)];
        moment.fromCamera = glm::mix(from.fromCamera, to.fromCamera, f);
        moment.focal_px = std::lerp(from.focal_px, to.focal_px, f);
        const glm::dvec3 inCamera = glm::mix(steps_[std::size_t(k)].cameraFromWorld * from.fromCamera,
                                             steps_[std::size_t(k + 1)].cameraFromWorld * to.fromCamera, f);
        moment.depth = std::max(-inCamera.z, near);
        camera::Projection picture = scene_.exposure.projection;
        picture.focal_px = moment.focal_px;
        moment.px = camera::project(picture, {inCamera.x, inCamera.y, -moment.depth}).px;
    }
}

}  // namespace virga::reference
