#include "passes/CpuSplashes.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "core/Simd.h"
#include "passes/CpuLamps.h"

namespace virga::passes::cpu {
namespace {

using glm::vec2;
using glm::vec3;
using glm::vec4;

constexpr float faceUp = 0.7f;   // least cosine between the surface's normal and up
constexpr float atEdge = 0.04f;  // bend of inverse depth over a block, relative, that is taken for an edge
constexpr float mostPerCell = 16, mostWeight = 2;

/// A surface that faces up, as a block of pixels shows it.
struct Surface {
    vec3 point, normal;  // from the camera, world axes [m]
    float span;          // of the block on the ground, no less than a cell [m]
    float fullSpan;      // of a block of the full picture [m]
};

class Emitter {
public:
    Emitter(const Frame& frame, SplashList& list)
        : frame_(frame), c_(frame.constants), cameraFromWorld_(frame.constants.cameraFromWorldOpen),
          worldFromCamera_(glm::transpose(cameraFromWorld_)), list_(list)
    {
    }

    void block(int x, int y)
    {
        corner_ = {float(x), float(y)};
        Surface surface;
        if (!surfaceAt(x + splashBlock / 2, y + splashBlock / 2, surface)) return;

        // Cells as large as the footprint on the ground of a block of the full picture, so that this one touches four
        // at most, and in a proxy the cells that the full picture's blocks in its place do.
        const float level = std::min(std::ceil(std::log2(surface.fullSpan / c_.splashGrid.x)), float(c_.splashTime.y));
        const float edge = c_.splashGrid.x * std::exp2(level);
        const float events = c_.splash.x * std::exp2(2 * level);
        // Where a cell holds more impacts than can be told apart, each stands for several, but for no more than look
        // like one: far ground would glitter.
        weight_ = std::clamp(events / mostPerCell, 1.0f, mostWeight);
        const float mean = std::min(events, mostPerCell);

        // Counted from the coarsest cell that the camera is in, so that floats stay small.
        const std::uint32_t subdivisions = 1u << (c_.splashTime.y - std::uint32_t(level));
        const std::uint32_t coarseX = c_.splashKey.y * subdivisions, coarseZ = c_.splashKey.z * subdivisions;
        const vec2 ground = vec2(surface.point.x, surface.point.z) + vec2(c_.splashGrid.y, c_.splashGrid.z);
        const vec2 low = glm::floor((ground - 0.5f * surface.span) / edge);
        const vec2 high =
            glm::min(glm::floor((ground + 0.5f * surface.span) / edge), low + std::ceil(1.0f / c_.splashGrid.w));
        for (auto j = int(low.y); j <= int(high.y); ++j)
            for (auto i = int(low.x); i <= int(high.x); ++i)
                for (std::uint32_t slot = 0; slot < 2; ++slot) {
                    const shared::uvec4 cell = shared::hash4(
                        shared::uvec4(std::uint32_t(i) + coarseX, std::uint32_t(j) + coarseZ, c_.splashTime.x - slot,
                                      c_.splashKey.x + std::uint32_t(level) * 977u));
                    impacts(surface, cell, poisson(mean, shared::unitFloat(cell.x)), slot, vec2(i, j), edge);
                }
    }

private:
    float depthAt(int x, int y) const
    {
        return frame_.depth.at(std::clamp(x, 0, frame_.width() - 1), std::clamp(y, 0, frame_.height() - 1));
    }

    /// The point that a pixel shows, from the camera, world axes.
    vec3 pointAt(vec2 pixel, float depth) const
    {
        const vec3 ray((pixel.x - c_.lens.z) / c_.lens.x, -(pixel.y - c_.lens.w) / c_.lens.x, -1.0f);
        return worldFromCamera_ * (ray * depth);
    }

    /// False where nothing flat faces up.
    bool surfaceAt(int x, int y, Surface& surface) const
    {
        const float depth = depthAt(x, y);
        if (!(depth < c_.splashDrop.w)) return false;
        constexpr int reach = splashBlock / 2;
        const float left = depthAt(x - reach, y), right = depthAt(x + reach, y);
        const float above = depthAt(x, y - reach), below = depthAt(x, y + reach);
        // Planes are straight in inverse depth. Leaves, wires and edges are not, and no splash can be seen on them.
        const float nearness = 1 / depth;
        if (std::abs(1 / left + 1 / right - 2 * nearness) > atEdge * nearness ||
            std::abs(1 / above + 1 / below - 2 * nearness) > atEdge * nearness)
            return false;
        const vec2 centre(float(x) + 0.5f, float(y) + 0.5f);
        surface.point = pointAt(centre, depth);
        const vec3 across = pointAt(centre + vec2(reach, 0), right) - surface.point;
        const vec3 down = pointAt(centre + vec2(0, reach), below) - surface.point;
        surface.normal = glm::normalize(glm::cross(across, down));
        if (surface.normal.y < 0) surface.normal = -surface.normal;
        if (!(surface.normal.y >= faceUp)) return false;
        const float footprint =
            2 * std::max(std::abs(across.x) + std::abs(down.x), std::abs(across.z) + std::abs(down.z));
        surface.span = std::max(footprint, c_.splashGrid.x);
        surface.fullSpan = std::max(footprint * c_.splashGrid.w, c_.splashGrid.x);
        return true;
    }

    /// A Poisson number of so small a mean, cut at the most that is drawn.
    static int poisson(float mean, float u)
    {
        float term = std::exp(-mean), sum = term;
        int count = 0;
        while (u > sum && count < 3 * int(mostPerCell)) {
            ++count;
            term *= mean / float(count);
            sum += term;
        }
        return count;
    }

    void impacts(const Surface& surface, const shared::uvec4& cell, int count, std::uint32_t slot, vec2 place,
                 float edge)
    {
        for (int event = 0; event < count; ++event) {
            const shared::uvec4 bits = shared::hash4(shared::uvec4(cell.y, cell.z, cell.w, std::uint32_t(event)));
            // Impacts of slot s happen during it and show for a lifetime: this slot's young, the last one's old.
            const float age = c_.splash.w - shared::unitFloat(bits.w) + float(slot);
            if (age < 0 || age >= 1) continue;
            const vec2 at = (place + vec2(shared::unitFloat(bits.x), shared::unitFloat(bits.y))) * edge -
                            vec2(c_.splashGrid.y, c_.splashGrid.z);
            const vec3& n = surface.normal;
            const float height =
                surface.point.y - (n.x * (at.x - surface.point.x) + n.z * (at.y - surface.point.z)) / n.y;
            const vec3 inCamera = cameraFromWorld_ * vec3(at.x, height, at.y);
            if (-inCamera.z < c_.range.x) continue;
            const float scale = c_.lens.x / -inCamera.z;
            const vec2 onPicture = vec2(c_.lens.z, c_.lens.w) + scale * vec2(inCamera.x, -inCamera.y);
            const vec2 inBlock = onPicture - corner_;
            if (!(inBlock.x >= 0 && inBlock.y >= 0 && inBlock.x < splashBlock && inBlock.y < splashBlock)) continue;

            const float diameter = shared::truncatedExponential(shared::unitFloat(bits.z), c_.splashDrop.x,
                                                                c_.splashDrop.y, c_.splashDrop.z);
            shared::Splash splash = shared::splashOf(diameter * c_.splash.z, age, shared::hash4(bits));
            splash.place = {onPicture.x, onPicture.y, scale, -inCamera.z};
            splash.look.w = weight_;
            if (frame_.features.fog) splash.light.x = std::exp(-frame_.fogTo(-inCamera.z));
            if (frame_.features.lights) {
                const vec3 lamps = lampsInDrop(frame_, vec3(at.x, height, at.y)) * splash.light.x;
                splash.light = {splash.light.x, lamps.x, lamps.y, lamps.z};
            }
            add(splash);
        }
    }

    void add(const shared::Splash& splash)
    {
        // Crown and droplets: these fly no higher than 0.9 m/s takes them, and no farther aside than 0.35 m/s.
        const float time = splash.look.y * c_.splash.y, pixels = splash.place.z;
        const float radius = std::max(splash.crown.x * pixels, 0.6f), height = std::max(splash.crown.y * pixels, 0.6f);
        const float thrown = std::max(0.9f * time - 4.905f * time * time, 0.0f) * pixels;
        const float ball = 1.5f * std::max(1.4f * splash.crown.w * pixels, 0.7f) + 1;
        list_.add(splash, splash.place.y - std::max(1.2f * height + 0.3f * radius, thrown + ball) - 1,
                  splash.place.y + std::max(0.4f * radius, ball) + 1);
    }

    const Frame& frame_;
    const shared::FrameConstants& c_;
    const glm::mat3 cameraFromWorld_, worldFromCamera_;
    SplashList& list_;
    vec2 corner_{};
    float weight_ = 1;
};

/// Draws splashes into a band.
struct Drawer {
    const Frame& frame;
    BandSums& band;

    VIRGA_INLINE void deposit(int x, int y, float alpha, const shared::Splash& splash) const
    {
        // A splash stands before the ground that it hits; only what is clearly nearer hides it.
        if (splash.place.w > frame.depth.row(y)[x] * 1.02f + 0.05f) return;
        const float optical = opticalDepthOf(std::min(alpha, 0.9f)) * opticalDepthSteps * splash.look.w;
        const std::uint32_t whole = steps(optical);
        if (whole == 0) return;
        std::uint32_t* sums =
            band.splashSums.data() +
            (std::size_t(y - band.firstRow) * std::size_t(frame.width()) + std::size_t(x)) * std::size_t(band.perPixel);
        sums[0] += whole;
        if (frame.features.fog) sums[1] += steps(optical * splash.light.x);
        if (frame.features.lights)
            for (int k = 0; k < 3; ++k) sums[frame.lampSums() + k] += steps(optical * splash.light[k + 1]);
    }

    /// Pixels from `low` to `high`, both included, inside the band.
    struct Box {
        int left, right, top, bottom;
    };
    Box boxOf(vec2 low, vec2 high) const
    {
        const auto inside = [](float v, int first, int last) {
            return int(std::clamp(std::floor(v), float(first), float(last)));
        };
        return {inside(low.x, 0, frame.width()), inside(high.x, -1, frame.width() - 1),
                inside(low.y, band.firstRow, band.lastRow), inside(high.y, band.firstRow - 1, band.lastRow - 1)};
    }

    /// A soft ball of radius r [px] around a place.
    void droplet(vec2 at, float r, float opacity, const shared::Splash& splash) const
    {
        const float soft = std::max(r, 0.7f);
        const float peak = std::min(opacity * (r * r) / (soft * soft), 0.9f);
        const Box box = boxOf(at - 1.5f * soft, at + 1.5f * soft);
        for (int y = box.top; y <= box.bottom; ++y)
            for (int x = box.left; x <= box.right; ++x) {
                const vec2 d = (vec2(float(x) + 0.5f, float(y) + 0.5f) - at) / soft;
                deposit(x, y, peak * std::exp(-d.x * d.x - d.y * d.y), splash);
            }
    }

    void crown(const shared::Splash& splash) const
    {
        const float radius = splash.crown.x * splash.place.z, height = splash.crown.y * splash.place.z;
        // Narrower than a pixel, the crown keeps what it covers.
        const float softRadius = std::max(radius, 0.6f), softHeight = std::max(height, 0.6f);
        const float opacity =
            splash.crown.z * std::min(1.0f, radius / softRadius) * std::min(1.0f, height / softHeight);
        const vec2 foot(splash.place.x, splash.place.y);
        const Box box = boxOf(foot - vec2(1.3f * softRadius, 1.2f * softHeight + 0.3f * softRadius),
                              foot + vec2(1.3f * softRadius, 0.4f * softRadius));
        const float thickness = 0.16f + 0.5f / std::max(softRadius, 1.0f);
        for (int y = box.top; y <= box.bottom; ++y)
            for (int x = box.left; x <= box.right; ++x) {
                const vec2 p = vec2(float(x) + 0.5f, float(y) + 0.5f) - foot;
                const float side = p.x / softRadius;
                // The rim is an ellipse seen at a slant; the wall leans outwards from its foot to the rim.
                const float up = (-p.y + 0.25f * softRadius * (1.0f - std::min(side * side, 1.0f))) / softHeight;
                const float inside = glm::smoothstep(-0.25f, 0.1f, up) * (1.0f - glm::smoothstep(0.6f, 1.15f, up));
                if (!(inside > 0)) continue;
                const float wall = std::abs(side) - (0.55f + 0.4f * std::clamp(up, 0.0f, 1.0f));
                const float sheet = 0.25f * (1.0f - glm::smoothstep(0.9f, 1.05f, std::abs(side))) +
                                    std::exp(-wall * wall / (thickness * thickness));
                const float alpha = opacity * sheet * inside;
                if (alpha > 0.002f) deposit(x, y, alpha, splash);
            }
    }

    /// Droplets: ballistic, the same life as the crown's, up to a few centimetres.
    void droplets(const shared::Splash& splash) const
    {
        const float time = splash.look.y * frame.constants.splash.y;
        const auto seed = std::uint32_t(splash.look.z);
        for (std::uint32_t n = 0; n < std::uint32_t(splash.look.x); ++n) {
            const shared::uvec4 bits = shared::hash4(shared::uvec4(seed, n, 17u, 91u));
            const float aside = (2 * shared::unitFloat(bits.x) - 1) * 0.35f;  // [m/s]
            const float up = 0.35f + 0.55f * shared::unitFloat(bits.y);       // [m/s]
            const float height = up * time - 4.905f * time * time;
            if (height < 0) continue;
            const vec2 at = vec2(splash.place.x, splash.place.y) + splash.place.z * vec2(aside * time, -height);
            droplet(at, splash.crown.w * (0.6f + 0.8f * shared::unitFloat(bits.z)) * splash.place.z, 0.8f, splash);
        }
    }
};

}  // namespace

void emitSplashes(const Frame& frame, int first, int last, SplashList& list)
{
    Emitter emitter(frame, list);
    for (int row = first; row < last; ++row)
        for (int x = 0; x < frame.width(); x += splashBlock) emitter.block(x, row * splashBlock);
}

void splatSplashes(const Frame& frame, const SplashList& list, std::size_t bandNumber, BandSums& band)
{
    const Drawer drawer{frame, band};
    for (const std::uint32_t number : list.ofBand[bandNumber]) {
        drawer.crown(list.items[number]);
        drawer.droplets(list.items[number]);
    }
}

}  // namespace virga::passes::cpu
