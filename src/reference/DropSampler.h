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

/// The drop is a disc of diameter f D / z px that moves over the picture. With an atlas, what it leaves is the matte
/// that it wears, laid along the way that it really takes: v in [0, 1] is the time from half a diameter before the
/// start to half a diameter after the end, u the place across. Either way a drop leaves pi/4 w^2 px times the opacity,
/// w its width at each moment; mattes have a mean of 1. Out of focus, samples are scattered over the circle of
/// confusion. Pixels are boxes: a sample counts for the pixel that it falls into, if what is there is no nearer.
///
/// Samples are a Kronecker lattice (powers of the generalised golden ratio, Roberts 2018) shifted by the drop's hash:
/// the error of a pixel falls about as 1 / samples^2 (tests/reference). Faint strokes take fewer, down to a sixteenth.
class DropSampler {
public:
    /// depth: of the picture [m], or empty. One for each thread.
    DropSampler(const Scene& scene, ConstImageViewF depth);

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
    ConstImageViewF depth_;
    std::vector<double> layerMeans_;
    std::vector<double> clear_;  // exp(-optical depth) at equal steps of depth up to far
    std::array<std::optional<optics::RingTransfer>, 3> transfer_;  // if there are lamps
    std::vector<Sum> sums_;                                        // of the drop at hand, a pixel each
    std::vector<std::uint32_t> touched_;
};

}  // namespace virga::reference
