// Which drops can be seen one by one; the others belong to the fog. Compiled by GLSL and C++ (shared/alias.h).
#ifndef VIRGA_FN
#define VIRGA_FN
#endif

/// Greatest depth [m] at which the stroke of a drop in focus reaches the matte value `threshold`.
///
/// A drop of diameter D at depth z puts the share pi/4 w^2, w = f D / z, of a pixel's area times the exposure onto the
/// picture; its stroke spreads it over the length f s / z + 1 px and, once w < 1, the width of one pixel:
///     alpha(z) = (pi/4) f^2 D^2 / (z (f s + z)),   alpha = threshold  at the positive root of
///     z^2 + f s z - (pi/4) f^2 D^2 / threshold = 0.
/// diameter [m], path: way during the exposure [m], focal_px [px], threshold > 0 (already divided by the opacity).
VIRGA_FN float visibleDepth(float diameter, float path, float focal_px, float threshold)
{
    float b = focal_px * path;
    float c = 0.78539816f * focal_px * focal_px * diameter * diameter / threshold;
    // The root in the form that does not cancel when b^2 >> c.
    return 2.0f * c / (b + sqrt(b * b + 4.0f * c));
}

/// Share q of the matte value `thin` that the stroke of a drop at `depth` [m] reaches, at most 1; thin 0: 1.
///
/// Under it a drop is one of very many faint ones, and is drawn with chance q^2 (its rank is below q^2), but 1 / q times as
/// dense. The variance and the power spectrum of what is drawn stay those of all of them; their mean falls to q, and the
/// veil (RainField::thinnedOpticalDepth) has the rest. Of all chances that draw as many strokes, q^2 keeps the fourth
/// moment lowest: every thinned stroke comes out at `thin`. After Cook, Halstead, Planck and Ryu 2007, "Stochastic
/// Simplification of Aggregate Detail".
VIRGA_FN float drawnShare(float depth, float diameter, float path, float focal_px, float thin)
{
    float reached = 0.78539816f * focal_px * focal_px * diameter * diameter;
    return min(1.0f, reached / (thin * depth * (focal_px * path + depth)));
}
