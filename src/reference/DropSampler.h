// What one drop leaves on the pixels, by sampling: moments of the exposure, places on the drop, places on the lens.
#pragma once

#include <cstdint>
#include <vector>

#include "optics/DropTransfer.h"
#include "reference/DropPaths.h"

namespace virga::reference {

/// One drop over one pixel.
struct Fragment {
    std::uint32_t pixel;
    std::uint64_t drop;
    double depth;       ///< mean [m]
    double alpha;       ///< share of the pixel and the exposure that the drop covers, times the opacity; at most 1
    double clear;       ///< share of the drop's light that the fog in front lets through
    glm::dvec3 lamps;   ///< light of lamps that the drop returns, fog taken off
    glm::dvec2 motion;  ///< of the drop from open to close [px]
};

/// What all samplers of a scene look up.
struct SamplerTables {
    explicit SamplerTables(const Scene& scene);

    std::vector<double> layerMeans;  ///< of the atlas's mattes
    std::vector<double> clear;       ///< exp(-optical depth) at equal steps of depth from 0 to far; empty: no fog
    std::array<std::optional<optics::RingTransfer>, 3> transfer;  ///< R, G, B; if there are lamps
};

/// The drop is a disc of diameter f D / z px that moves over the picture. With an atlas, what it leaves is the matte
/// that it wears, laid along the way that it really takes: v in [0, 1] is the time from half a diameter before the
/// start to half a diameter after the end, u the place across. Either way a drop leaves pi/4 w^2 px times the opacity,
/// w its width at each moment; mattes have a mean of 1. Out of focus, samples are scattered over the circle of
/// confusion. Pixels are boxes: a sample counts for the pixel that it falls into, if what is there is no nearer.
///
/// Samples are a lattice (equal steps of the exposure; powers of a generalised golden ratio on drop and lens, Roberts
/// 2018) shifted by the drop's hash. At the default of 16 a stroke is off by 1.5 % RMS in focus, and the error falls a
/// little faster than 1 / samples (tests/reference). Where noise passes 1 it is cut off: a drop that
/// stands still and covers pixels whole loses 1 %. Faint strokes take fewer samples, down to a sixteenth.
class DropSampler {
public:
    /// depth: of the picture [m], or empty. One for each thread.
    DropSampler(const Scene& scene, const SamplerTables& tables, ConstImageViewF depth);

    /// Appends a fragment for each pixel of rows [firstRow, lastRow) that the drop covers.
    void sample(const DropPath& path, int firstRow, int lastRow, std::vector<Fragment>& fragments);

private:
    struct Sum {
        double alpha = 0, depth = 0, clear = 0;
        glm::dvec3 lamps{0.0};
    };
    glm::dvec3 lampsIn(const DropPath::Moment& moment, double share) const;
    double clearTo(double depth) const;

    const Scene& scene_;
    const SamplerTables& tables_;
    ConstImageViewF depth_;
    std::vector<Sum> sums_;  // of the drop at hand, a pixel each
    std::vector<std::uint32_t> touched_;
};

}  // namespace virga::reference
