// Where each drop is while the shutter is open. Which drops exist is the shared definition (shaders/shared), read at
// several moments of the exposure instead of its ends alone: gusts and turbulence bend a way, a camera that turns bends
// its picture.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <vector>

#include "reference/Scene.h"

namespace virga::reference {

/// One drop's exposure at equal steps of time from open to close.
struct DropPath {
    static constexpr int most = 17;

    struct Moment {
        glm::dvec3 fromCamera;  ///< world axes [m]
        glm::dvec2 px;          ///< on the picture
        double depth;           ///< [m]
        double focal_px;
    };
    int moments = 2;  ///< 2 where the way is under two pixels long, else `most`
    std::array<Moment, most> at;
    double diameter;       ///< [m]
    double shown = 1;      ///< share of the exposure that it is not nearer than the near limit: the moments' time
    double standsFor = 1;  ///< so many times as dense as it is: for drops that are thinned out
    std::uint32_t look;    ///< random bits for what the stroke looks like
    std::uint64_t id;      ///< of this drop alone: a hash of (cell, number)

    double length_px() const;
};

class DropPaths {
public:
    /// A picture may have so many; more would not fit into memory.
    static constexpr double mostDrops = 2e7;

    /// Throws Error(InvalidArgument) if the picture would have more than mostDrops.
    explicit DropPaths(const Scene& scene);

    std::size_t cells() const { return list_.cells.size(); }
    /// Calls `visit` for each drop of a cell that is drawn.
    template <class Visit>
    void forCell(std::size_t cell, Visit&& visit) const
    {
        DropPath path;
        for (std::uint32_t i = 0; i < list_.dropsIn(cell); ++i)
            if (follow(cell, i, path)) visit(path);
    }
    /// Drops listed, drawn or not.
    std::size_t drops() const { return list_.drops; }

private:
    bool follow(std::size_t cell, std::uint32_t index, DropPath& path) const;
    void leaveOutNearer(DropPath& path) const;
    DropPath::Moment momentOf(std::size_t cell, std::uint32_t index, int step) const;

    struct Step {
        std::vector<shared::DropClass> classes;  // travel up to this moment
        std::array<shared::TurbulenceWave, 4> waves;
        glm::dmat3 cameraFromWorld;
        double focal_px;
    };
    const Scene& scene_;
    particles::CellList list_;
    std::array<Step, DropPath::most> steps_;
};

/// Greatest depth [m] at which a drop's stroke reaches the matte value `threshold`: the renderer's rule for which drops
/// it draws (shaders/shared/visibility.glsl), the positive root of z^2 + f s z = pi/4 f^2 D^2 / threshold.
double drawnDepth(double diameter_m, double path_m, double focal_px, double threshold);

/// The matte value of a drop's stroke as a share of `thin`, at most 1: the drop is drawn if its rank is under the
/// square of it (drawnShare of the same file).
double thinnedShare(double diameter_m, double path_m, double focal_px, double depth_m, double thin);

}  // namespace virga::reference
