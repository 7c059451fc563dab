#include "passes/CpuGrade.h"

#include <algorithm>

#include "core/Lanes.h"

namespace virga::passes::cpu {
namespace {

using lanes::Float;

constexpr float ln2 = 0.69314718056f;

/// Eight pixels, a channel each.
struct Colors {
    Float channel[4];
};

VIRGA_INLINE Colors load(const float* rgba, int pixels)
{
    float planes[4][lanes::count] = {};
    for (int i = 0; i < pixels; ++i)
        for (int k = 0; k < 4; ++k) planes[k][i] = rgba[4 * i + k];
    return {{lanes::load(planes[0]), lanes::load(planes[1]), lanes::load(planes[2]), lanes::load(planes[3])}};
}

VIRGA_INLINE void store(const Colors& colors, float* rgba, int pixels)
{
    float planes[4][lanes::count];
    for (int k = 0; k < 4; ++k) lanes::store(colors.channel[k], planes[k]);
    for (int i = 0; i < pixels; ++i)
        for (int k = 0; k < 4; ++k) rgba[4 * i + k] = planes[k][i];
}

/// What the table adds at a place between its nodes, trilinear; `place` is three arrays of eight.
VIRGA_INLINE void lutShift(const Frame& frame, const float (&place)[3][lanes::count], float (&shift)[3][lanes::count])
{
    const int size = int(frame.constants.lut.z);
    for (int i = 0; i < lanes::count; ++i) {
        int node[3];
        float t[3];
        for (int k = 0; k < 3; ++k) {
            node[k] = std::min(int(place[k][i]), size - 2);
            t[k] = place[k][i] - float(node[k]);
        }
        float sum[3] = {};
        for (int corner = 0; corner < 8; ++corner) {
            const int dx = corner & 1, dy = (corner >> 1) & 1, dz = corner >> 2;
            const float weight = (dx ? t[0] : 1 - t[0]) * (dy ? t[1] : 1 - t[1]) * (dz ? t[2] : 1 - t[2]);
            const float* texel =
                frame.lut.data() + 3 * std::size_t(node[0] + dx + size * (node[1] + dy + size * (node[2] + dz)));
            for (int k = 0; k < 3; ++k) sum[k] += weight * texel[k];
        }
        for (int k = 0; k < 3; ++k) shift[k][i] = sum[k];
    }
}

/// Pitie et al. 2005, baked: twin of grade::apply. Works on colours that are not premultiplied.
VIRGA_INLINE void transfer(const Frame& frame, Colors& colors)
{
    const float delta = frame.constants.lut.x;
    const Float whole = lanes::log(Float(1.0f + frame.constants.lut.y / delta)) * (1 / ln2);
    const Float alpha = lanes::pick(colors.channel[3] > 0.0f, colors.channel[3], 1.0f);
    Float encoded[3];
    float place[3][lanes::count], shift[3][lanes::count];
    for (int k = 0; k < 3; ++k) {
        const Float c = colors.channel[k] / alpha;
        encoded[k] = lanes::pick(c < 0.0f, c * (1 / (delta * ln2)),
                                 lanes::log(lanes::max(c, 0.0f) * (1 / delta) + 1.0f) * (1 / ln2)) /
                     whole;
        lanes::store(lanes::clamp(encoded[k], 0.0f, 1.0f) * (frame.constants.lut.z - 1.0f), place[k]);
    }
    lutShift(frame, place, shift);
    for (int k = 0; k < 3; ++k) {
        const Float e = (encoded[k] + lanes::load(shift[k])) * whole;
        const Float c = lanes::pick(e < 0.0f, e * (delta * ln2), (lanes::exp(e * ln2) - 1.0f) * delta);
        colors.channel[k] = c * alpha;
    }
}

/// Starik and Werman 2003: blended with its luminance, then scaled. Twin of grade::darkened.
VIRGA_INLINE void darken(const Frame& frame, Colors& colors)
{
    const shared::FrameConstants& c = frame.constants;
    const Float luminance = colors.channel[0] * 0.2126f + colors.channel[1] * 0.7152f + colors.channel[2] * 0.0722f;
    for (int k = 0; k < 3; ++k)
        colors.channel[k] = lanes::mix(colors.channel[k], luminance, c.grade.y) * (1.0f - c.grade.x);
}

}  // namespace

VIRGA_SIMD void gradeRow(const Frame& frame, float* rgba, int pixels)
{
    for (int x = 0; x < pixels; x += lanes::count) {
        const int here = std::min(lanes::count, pixels - x);
        Colors colors = load(rgba + 4 * x, here);
        if (frame.features.colorTransfer) transfer(frame, colors);
        if (frame.features.darken) darken(frame, colors);
        store(colors, rgba + 4 * x, here);
    }
}

}  // namespace virga::passes::cpu
