// What rain and fog change in a picture, beauty - plate, as statistics: what an eye that cannot tell one drop from
// another still sees of how many there are, how strong they are and how fine.
#pragma once

#include <vector>

#include "core/Image.h"

namespace virga::bench {

/// Mean power of one channel in rings of the spatial frequency: ring k holds frequencies from k to k + 1 cycles over
/// the shorter side, up to half a cycle a pixel; what is beyond that in the corners is in the last. By Parseval's
/// theorem the powers of all frequencies add up to the variance; rings hold sums. The mean itself (frequency 0) is left
/// out. Both sides at least 2 pixels.
std::vector<double> powerSpectrum(ConstImageViewF picture, int channel);

/// Over all pixels of a channel.
struct Moments {
    double mean = 0, variance = 0;
    double skewness = 0;  ///< third central moment over variance^(3/2); 0 where nothing varies
};
Moments momentsOf(ConstImageViewF picture, int channel);

/// Two effects beside each other, of green. Ratios are over the truth's; 1 where the truth has nothing.
struct EffectComparison {
    double mean = 1, variance = 1;
    double coarse = 1, fine = 1;  ///< power below and above an eighth of a cycle a pixel
    double skewness = 0, trueSkewness = 0;
    double spectrum_dB = 0;  ///< root mean square over the rings of 10 log10 of the ratio of their powers
};
EffectComparison compareEffects(ConstImageViewF effect, ConstImageViewF truth);

}  // namespace virga::bench
