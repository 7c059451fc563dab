#include "passes/CpuDrops.h"

#include <algorithm>
#include <cmath>

#include "core/Lanes.h"
#include "passes/CpuLamps.h"
#include "passes/CpuSmallStrokes.h"

namespace virga::passes::cpu {
namespace {

using lanes::Float;
using lanes::Mask;
using lanes::Uint;

/// drop_field.glsl and visibility.glsl of eight drops at a time: their types are the lanes' here.
namespace eight {
using vec3 = lanes::Vec3;
using vec4 = lanes::Vec4;
using uvec4 = lanes::Uvec4;
using uint = lanes::Uint;
using lanes::abs;
using lanes::dot;
using lanes::exp;
using lanes::fract;
using lanes::log;
using lanes::min;
using lanes::sqrt;
#pragma push_macro("VIRGA_FN")
#undef VIRGA_FN
#define VIRGA_FN VIRGA_INLINE
#define float Float
#include "shared/drop_field.glsl"
#include "shared/visibility.glsl"
#undef float
#pragma pop_macro("VIRGA_FN")
}  // namespace eight

VIRGA_INLINE lanes::Vec4 broadcast(const glm::vec4& v) { return {v.x, v.y, v.z, v.w}; }
VIRGA_INLINE eight::Cell broadcast(const shared::Cell& cell)
{
    return {{cell.key.x, cell.key.y, cell.key.z, cell.key.w}, broadcast(cell.origin), broadcast(cell.phase)};
}
VIRGA_INLINE eight::DropClass broadcast(const shared::DropClass& c)
{
    return {broadcast(c.size), broadcast(c.travel), broadcast(c.rank)};
}
VIRGA_INLINE eight::TurbulenceWave broadcast(const shared::TurbulenceWave& w)
{
    return {broadcast(w.wave), broadcast(w.shift)};
}

VIRGA_INLINE lanes::Vec3 turned(const glm::mat4& m, const lanes::Vec3& v)
{
    return {v.x * m[0][0] + v.y * m[1][0] + v.z * m[2][0], v.x * m[0][1] + v.y * m[1][1] + v.z * m[2][1],
            v.x * m[0][2] + v.y * m[1][2] + v.z * m[2][2]};
}

/// Where eight drops fall on the picture.
struct Paths {
    Float startX, startY, endX, endY;
    Float depthOpen, depthClose, depth;
    Float width, halfWidth, blur;
    Float shown;  // share of the exposure that the drop is not nearer than the near limit
    Float drawn;  // see drawnShare
    Mask isSeen;
};

/// What strokes are widened to [px], as in pass_emit_strokes.comp.
constexpr float narrowest = 0.05f;

/// Ways that begin or end nearer than `near` are those beyond it.
VIRGA_INLINE void leaveOutNearer(float near, lanes::Vec3& open, lanes::Vec3& close, Paths& p)
{
    const Float crosses = (Float(near) - p.depthOpen) / (p.depthClose - p.depthOpen);
    const lanes::Vec3 crossing = {open.x + (close.x - open.x) * crosses, open.y + (close.y - open.y) * crosses,
                                  Float(-near)};
    const Mask opens = (p.depthOpen < near) & (p.depthClose >= near);
    const Mask closes = (p.depthClose < near) & (p.depthOpen >= near);
    open = {lanes::pick(opens, crossing.x, open.x), lanes::pick(opens, crossing.y, open.y), open.z};
    close = {lanes::pick(closes, crossing.x, close.x), lanes::pick(closes, crossing.y, close.y), close.z};
    p.depthOpen = lanes::pick(opens, near, p.depthOpen);
    p.depthClose = lanes::pick(closes, near, p.depthClose);
    p.shown = lanes::pick(opens, Float(1.0f) - crosses, lanes::pick(closes, crosses, 1.0f));
}

VIRGA_INLINE Paths pathsOf(const Frame& frame, const eight::Drop& drop, const eight::DropClass& dropClass)
{
    const shared::FrameConstants& c = frame.constants;
    Paths p;
    lanes::Vec3 open = turned(c.cameraFromWorldOpen, drop.open);
    const bool moves = frame.features.cameraMotion;
    lanes::Vec3 close = turned(moves ? c.cameraFromWorldClose : c.cameraFromWorldOpen, drop.close);
    const float focalClose = moves ? c.lens.y : c.lens.x;
    const float focal = std::sqrt((c.lens.x * (c.lens.x + focalClose) + focalClose * focalClose) / 3);
    p.depthOpen = -open.z;
    p.depthClose = -close.z;
    p.shown = 1.0f;
    if ((lanes::min(p.depthOpen, p.depthClose) < c.range.x).any()) leaveOutNearer(c.range.x, open, close, p);
    p.depth = (p.depthOpen + p.depthClose) * 0.5f;
    const Float path = dropClass.travel.w * c.focus.z;
    const Float visible = eight::visibleDepth(drop.diameter, path, Float(c.boost.w), Float(c.range.z));
    p.drawn = eight::drawnShare(p.depth, drop.diameter, path, Float(c.boost.w), Float(c.medium.y));
    p.isSeen = (lanes::min(p.depthOpen, p.depthClose) >= c.range.x) & (p.depth <= c.range.y) & (p.depth <= visible) &
               (drop.rank < p.drawn * p.drawn);
    if (!p.isSeen.any()) return p;

    const Float perOpen = Float(c.lens.x) / p.depthOpen, perClose = Float(focalClose) / p.depthClose;
    p.startX = Float(c.lens.z) + perOpen * open.x;
    p.startY = Float(c.lens.w) - perOpen * open.y;
    p.endX = Float(c.lens.z) + perClose * close.x;
    p.endY = Float(c.lens.w) - perClose * close.y;
    // So that w^2 is its mean over the exposure: that of f^2 is (f0^2 + f0 f1 + f1^2) / 3, that of 1/z^2 is 1 / (z0
    // z1).
    p.width = drop.diameter * focal / lanes::sqrt(p.depthOpen * p.depthClose);
    const Float confusion = lanes::abs(Float(1.0f) / p.depth - c.focus.y) * (focal * c.focus.x);
    p.halfWidth = lanes::max(lanes::sqrt(p.width * p.width + confusion * confusion), narrowest) * 0.5f;
    p.blur = lanes::pick(confusion > 1.0f, confusion * 0.25f, 0.0f);
    const Float margin = p.halfWidth + p.blur + 1.0f;
    p.isSeen = p.isSeen & (lanes::max(p.startX, p.endX) + margin >= 0.0f) &
               (lanes::max(p.startY, p.endY) + margin >= 0.0f) &
               (lanes::min(p.startX, p.endX) - margin <= float(frame.width())) &
               (lanes::min(p.startY, p.endY) - margin <= float(frame.height()));
    return p;
}

/// Twin of matte::strokeLayer, plus 1, and of the oscillations that it asks for.
VIRGA_INLINE Float matteOf(const Frame& frame, const Float& diameter, const Float& random)
{
    const Mattes& m = frame.mattes;
    const Float frequency = Float(3.8488e-3f) / lanes::sqrt(diameter * diameter * diameter * 0.125f);
    const Float beads = frequency * frame.constants.focus.z;
    const auto ramp = [](const Float& t) __attribute__((always_inline))
    {
        const Float held = lanes::clamp(t, 0.0f, 1.0f);
        return held * held * (Float(3.0f) - held * 2.0f);
    };
    const Float mm = diameter * 1e3f;
    const Float strength = ramp((mm - 0.8f) / 0.6f) * (Float(1.0f) - ramp((mm - 1.6f) / 1.0f) * 0.5f);
    const float few = std::min(2.0f, float(m.variants));
    Float group = 0.0f;
    if (frame.constants.focus.z > 0)
        group =
            lanes::clamp(lanes::floor(lanes::log(beads / m.firstBeadCycles) * (m.groupsPerOctave * 1.44269504f) + 0.5f),
                         0.0f, float(m.groups - 1));
    const Float choices = m.groups == 1 ? Float(float(m.variants)) : strength * (float(m.variants) - few) + few;
    const Float variant = lanes::clamp(lanes::floor(random * choices), 0.0f, float(m.variants - 1));
    return group * float(m.variants) + variant + 1.0f;
}

/// Into the list, and into the bands that it may touch.
void add(const Frame& frame, const shared::Stroke& stroke, StrokeList& list)
{
    // A matte may be wider than its drop, and rows are rounded outwards.
    const float reach = 1.5f * std::max(1.0f, frame.mattes.acrossDiameters) * stroke.body.x + stroke.look.w + 2;
    const float low = std::min(stroke.path.y, stroke.path.w) - reach,
                high = std::max(stroke.path.y, stroke.path.w) + reach;
    if (!frame.features.lights && !frame.features.nearest && isSmall(frame, stroke))
        list.addSmall(stroke, low, high);
    else
        list.add(stroke, low, high);
}

}  // namespace

VIRGA_SIMD void emitStrokes(const Frame& frame, const particles::CellList& cells, std::size_t first, std::size_t last,
                            StrokeList& list)
{
    const eight::TurbulenceWave waves[4] = {broadcast(cells.waves[0]), broadcast(cells.waves[1]),
                                            broadcast(cells.waves[2]), broadcast(cells.waves[3])};
    const lanes::UintVector counting = {0, 1, 2, 3, 4, 5, 6, 7};
    for (std::size_t c = first; c < last; ++c) {
        const std::uint32_t drops = cells.dropsIn(c);
        const eight::Cell cell = broadcast(cells.cells[c]);
        const eight::DropClass dropClass = broadcast(cells.classes[cells.cells[c].key.z]);
        for (std::uint32_t n = 0; n < drops; n += lanes::count) {
            const Uint index(counting + n);
            const eight::Drop drop = eight::dropInCell(cell, dropClass, waves[0], waves[1], waves[2], waves[3], index);
            Paths p = pathsOf(frame, drop, dropClass);
            p.isSeen = p.isSeen & Mask{(lanes::IntVector)(index.v < drops)};
            if (!p.isSeen.any()) continue;

            const Float matte = matteOf(frame, drop.diameter, eight::unitFloat(drop.look));
            const Float covered = p.width * p.width * p.shown * (0.78539816f * frame.constants.range.w) / p.drawn;
            const Float share = p.width / (p.halfWidth * 2.0f);
            for (int lane = 0; lane < lanes::count; ++lane) {
                if (!p.isSeen[lane]) continue;
                const bool isMirrored = (drop.look.v[lane] & 1u) != 0;
                shared::Stroke stroke;
                stroke.path = {p.startX[lane], p.startY[lane], p.endX[lane], p.endY[lane]};
                stroke.body = {p.halfWidth[lane], covered[lane], p.depthOpen[lane], p.depthClose[lane]};
                stroke.look = {isMirrored ? -matte[lane] : matte[lane], 1.0f, share[lane], p.blur[lane]};
                if (frame.features.fog) stroke.look.y = std::exp(-frame.fogTo(p.depth[lane]));
                if (frame.features.lights) {
                    const glm::vec3 open(drop.open.x[lane], drop.open.y[lane], drop.open.z[lane]);
                    const glm::vec3 close(drop.close.x[lane], drop.close.y[lane], drop.close.z[lane]);
                    // The veil knows nothing of lamps: strokes bring the light of those that are not drawn as well,
                    // 1 / q^2 in all.
                    list.lamps.push_back(lampsInDrop(frame, 0.5f * (open + close)) * (stroke.look.y / p.drawn[lane]));
                }
                add(frame, stroke, list);
            }
        }
    }
}

}  // namespace virga::passes::cpu
