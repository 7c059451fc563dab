#include "grade/ColorTransfer.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>

#include "core/Error.h"
#include "core/Parallel.h"

namespace virga::grade {
namespace {

constexpr int kRounds = 24;  // of stiffening; ordinary pictures need 3 to 12

// Steps between nodes along which the table is kept from folding and stretching: the channels, grey, and the three
// differences of channels, where a fold would turn a hue into its opposite.
constexpr std::array<std::array<int, 3>, 7> kSteps{
    {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}, {1, -1, 0}, {0, 1, -1}, {1, 0, -1}}};

using Color = std::array<double, 3>;
using Frame = std::array<Color, 3>;  // three orthogonal unit axes

// Stafford's variant 13 of splitmix64's mixer, to [0, 1).
double hash01(std::uint64_t key)
{
    std::uint64_t z = key * 0x9e3779b97f4a7c15u + 0x2545f4914f6cdd1du;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return double(z >> 11) * 0x1p-53;
}

// The first frame is red, green, blue; the others are uniform over the rotations (Shoemake 1992, "Uniform random
// rotations").
Frame frameOfIteration(int iteration)
{
    if (iteration == 0) return {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    const double a = hash01(3 * iteration), b = 2 * std::numbers::pi * hash01(3 * iteration + 1),
                 c = 2 * std::numbers::pi * hash01(3 * iteration + 2);
    const double x = std::sqrt(1 - a) * std::sin(b), y = std::sqrt(1 - a) * std::cos(b);
    const double z = std::sqrt(a) * std::sin(c), w = std::sqrt(a) * std::cos(c);
    return {{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
             {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
             {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}}};
}

double dot(const Color& a, const Color& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// About `wanted` pixels, spread evenly: equal steps through each picture's pixels, each moved inside its step by a
// hash. The same picture gives the same pixels, whether it is plate or reference.
std::vector<Color> samplePixels(const std::vector<ConstImageViewF>& pictures, int wanted, const char* what)
{
    std::vector<Color> colors;
    for (const ConstImageViewF& picture : pictures) {
        if (picture.channels() < 3 || picture.empty())
            throw Error(ErrorCode::Input, "colour transfer: the {} has {}x{} pixels of {} channels, not of 3", what,
                        picture.width(), picture.height(), picture.channels());
        const std::int64_t pixels = std::int64_t(picture.width()) * picture.height();
        const std::int64_t take = std::min<std::int64_t>(pixels, std::max<std::int64_t>(1, wanted / pictures.size()));
        const double step = double(pixels) / double(take);
        for (std::int64_t i = 0; i < take; ++i) {
            const std::int64_t at = std::min(pixels - 1, std::int64_t((double(i) + hash01(i)) * step));
            const float* p = picture.pixel(int(at % picture.width()), int(at / picture.width()));
            if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) continue;
            colors.push_back({std::max(0.0f, p[0]), std::max(0.0f, p[1]), std::max(0.0f, p[2])});
        }
    }
    if (colors.empty()) throw Error(ErrorCode::Input, "colour transfer: the {} has no finite pixel", what);
    return colors;
}

// How far each projection of the plate must go for the distributions to be the same: quantile to quantile. Equal values
// share the mean of their ranks, so that equal colours stay equal.
std::vector<double> matchAlongAxis(const std::vector<double>& plate, std::vector<double> reference)
{
    std::vector<std::pair<double, int>> order(plate.size());
    for (std::size_t i = 0; i < plate.size(); ++i) order[i] = {plate[i], int(i)};
    std::sort(order.begin(), order.end());
    std::sort(reference.begin(), reference.end());
    const double ratio = double(reference.size()) / double(plate.size());
    std::vector<double> move(plate.size());
    for (std::size_t i = 0; i < order.size();) {
        std::size_t j = i;
        while (j < order.size() && order[j].first == order[i].first) ++j;
        const double rank = std::clamp(0.5 * double(i + j) * ratio - 0.5, 0.0, double(reference.size() - 1));
        const std::size_t below = std::size_t(rank), above = std::min(below + 1, reference.size() - 1);
        const double target = std::lerp(reference[below], reference[above], rank - double(below));
        for (; i < j; ++i) move[order[i].second] = target - order[i].first;
    }
    return move;
}

// The plate's colours after the transfer (Pitie et al. 2005, section 3).
std::vector<Color> transferred(std::vector<Color> colors, const std::vector<Color>& reference, int iterations)
{
    for (int iteration = 0; iteration < iterations; ++iteration) {
        const Frame frame = frameOfIteration(iteration);
        std::array<std::vector<double>, 3> moves;
        parallelFor(0, 3, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (std::ptrdiff_t axis = first; axis < last; ++axis) {
                std::vector<double> from(colors.size()), to(reference.size());
                for (std::size_t i = 0; i < from.size(); ++i) from[i] = dot(frame[axis], colors[i]);
                for (std::size_t i = 0; i < to.size(); ++i) to[i] = dot(frame[axis], reference[i]);
                moves[axis] = matchAlongAxis(from, std::move(to));
            }
        });
        for (int axis = 0; axis < 3; ++axis)
            for (std::size_t i = 0; i < colors.size(); ++i)
                for (int k = 0; k < 3; ++k) colors[i][k] += frame[axis][k] * moves[axis][i];
    }
    return colors;
}

// Displacements on the table's nodes, channel after channel.
class Nodes {
public:
    Nodes(int size, double smoothness)
        : size_(size), weight_(count()), target_(3, std::vector<double>(count())), d_(target_)
    {
        stiffness_.fill(std::vector<double>(count(), smoothness));
    }

    std::size_t count() const { return std::size_t(size_) * size_ * size_; }
    const std::vector<double>& channel(int k) const { return d_[k]; }

    void add(const Color& at, const Color& move)
    {
        std::array<int, 3> cell;
        Color f;
        for (int k = 0; k < 3; ++k) {
            const double x = std::clamp(at[k], 0.0, 1.0) * (size_ - 1);
            cell[k] = std::min(int(x), size_ - 2);
            f[k] = x - cell[k];
        }
        for (int corner = 0; corner < 8; ++corner) {
            double w = 1;
            std::size_t node = 0;
            for (int k = 2; k >= 0; --k) {
                const int bit = corner >> k & 1;
                w *= bit ? f[k] : 1 - f[k];
                node = node * size_ + cell[k] + bit;
            }
            weight_[node] += w;
            for (int k = 0; k < 3; ++k) target_[k][node] += w * move[k];
        }
    }

    // Sums to means, and the number of samples to a trust in 0..1: some are needed, more add little, so that a large
    // even area of the plate does not outweigh smoothness.
    void finish(double enough)
    {
        for (std::size_t i = 0; i < count(); ++i) {
            if (weight_[i] <= 0) continue;
            for (int k = 0; k < 3; ++k) target_[k][i] /= weight_[i];
            weight_[i] /= weight_[i] + enough;
        }
    }

    // Minimises sum trust (d - target)^2 + sum over neighbours stiffness (d_i - d_j)^2, by conjugate gradients
    // preconditioned with the diagonal, from the d that is there. Nodes without samples take what lies around them.
    void solve()
    {
        std::vector<double> diagonal = weight_;
        forEachEdge([&](std::size_t a, std::size_t b, int axis) {
            diagonal[a] += stiffness_[axis][a], diagonal[b] += stiffness_[axis][a];
        });
        parallelFor(0, 3, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (std::ptrdiff_t k = first; k < last; ++k) solveChannel(target_[k], diagonal, d_[k]);
        });
    }

    // Doubles the stiffness of the edges along each step (of kSteps) whose colour change, seen along the step, is
    // reversed or more than maxSlope times the step. Returns the share of all displacements' differences that could
    // stay if they were shrunk until no step is so; 1 if none is.
    double stiffen(double maxSlope)
    {
        std::array<std::vector<char>, 3> bad;
        bad.fill(std::vector<char>(count(), 0));
        double share = 1;
        for (const std::array<int, 3>& step : kSteps) {
            const int squared = step[0] * step[0] + step[1] * step[1] + step[2] * step[2];
            const double scale = double(size_ - 1) / squared;
            std::array<int, 3> at;
            for (at[2] = 0; at[2] < size_; ++at[2])
                for (at[1] = 0; at[1] < size_; ++at[1])
                    for (at[0] = 0; at[0] < size_; ++at[0]) {
                        const std::array<int, 3> to{at[0] + step[0], at[1] + step[1], at[2] + step[2]};
                        if (std::ranges::min(to) < 0 || std::ranges::max(to) >= size_) continue;
                        const std::size_t a = node(at), b = node(to);
                        double along = 0;
                        for (int k = 0; k < 3; ++k) along += step[k] * (d_[k][b] - d_[k][a]);
                        const double slope = 1 + scale * along;
                        if (slope >= 0 && slope <= maxSlope) continue;
                        share = std::min(share, slope < 0 ? 1 / (1 - slope) : (maxSlope - 1) / (slope - 1));
                        std::array<int, 3> walk = at;  // one axis after another
                        for (int k = 0; k < 3; ++k) {
                            if (step[k] > 0) bad[k][node(walk)] = 1;
                            walk[k] += step[k];
                            if (step[k] < 0) bad[k][node(walk)] = 1;
                        }
                    }
        }
        for (int axis = 0; axis < 3; ++axis)
            for (std::size_t i = 0; i < count(); ++i)
                if (bad[axis][i]) stiffness_[axis][i] *= 2;
        return share;
    }

    // Shrinks the displacements towards their mean where the samples are. The slope s of a step becomes
    // 1 + share (s - 1).
    void shrink(double share)
    {
        for (std::vector<double>& d : d_) {
            const double mean = std::inner_product(d.begin(), d.end(), weight_.begin(), 0.0) /
                                std::accumulate(weight_.begin(), weight_.end(), 0.0);
            for (double& value : d) value = mean + share * (value - mean);
        }
    }

private:
    std::size_t node(const std::array<int, 3>& at) const
    {
        return (std::size_t(at[2]) * size_ + at[1]) * size_ + at[0];
    }
    std::size_t stride(int axis) const
    {
        return axis == 0 ? 1 : axis == 1 ? std::size_t(size_) : std::size_t(size_) * size_;
    }

    // body(node, next node along the axis, axis)
    template <class Body>
    void forEachEdge(Body&& body) const
    {
        for (int b = 0; b < size_; ++b)
            for (int g = 0; g < size_; ++g)
                for (int r = 0; r < size_; ++r) {
                    const std::size_t i = (std::size_t(b) * size_ + g) * size_ + r;
                    if (r + 1 < size_) body(i, i + stride(0), 0);
                    if (g + 1 < size_) body(i, i + stride(1), 1);
                    if (b + 1 < size_) body(i, i + stride(2), 2);
                }
    }

    // y = (trust + stiffness Laplacian) x
    void multiply(const std::vector<double>& x, std::vector<double>& y) const
    {
        for (std::size_t i = 0; i < x.size(); ++i) y[i] = weight_[i] * x[i];
        forEachEdge([&](std::size_t a, std::size_t b, int axis) {
            const double pull = stiffness_[axis][a] * (x[b] - x[a]);
            y[a] -= pull, y[b] += pull;
        });
    }

    void solveChannel(const std::vector<double>& target, const std::vector<double>& diagonal,
                      std::vector<double>& x) const
    {
        const std::size_t n = x.size();
        std::vector<double> residual(n), direction(n), product(n), scaled(n);
        const auto inner = [](const std::vector<double>& a, const std::vector<double>& b) {
            return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
        };
        multiply(x, product);
        for (std::size_t i = 0; i < n; ++i) {
            residual[i] = weight_[i] * target[i] - product[i];
            direction[i] = scaled[i] = residual[i] / diagonal[i];
        }
        double power = inner(residual, scaled);
        for (int iteration = 0; iteration < 400 && power > 1e-8; ++iteration) {
            multiply(direction, product);
            const double step = power / inner(direction, product);
            for (std::size_t i = 0; i < n; ++i) {
                x[i] += step * direction[i];
                residual[i] -= step * product[i];
                scaled[i] = residual[i] / diagonal[i];
            }
            const double next = inner(residual, scaled);
            for (std::size_t i = 0; i < n; ++i) direction[i] = scaled[i] + next / power * direction[i];
            power = next;
        }
    }

    int size_;
    std::vector<double> weight_;                    // per node: number of samples, then trust
    std::vector<std::vector<double>> target_;       // per channel and node: mean displacement of the samples
    std::array<std::vector<double>, 3> stiffness_;  // per axis and node: of the edge to the next node
    std::vector<std::vector<double>> d_;            // per channel and node: the smooth displacement
};

}  // namespace

bool ColorLut::isIdentity() const noexcept
{
    return std::ranges::all_of(rgb, [](float d) { return d == 0; });
}

double encode(const ColorLut& lut, double linear) noexcept
{
    const double range = std::log2(1 + double(lut.maximum) / lut.delta);
    const double x = linear / lut.delta;
    return (x < 0 ? x * std::numbers::log2e : std::log2(1 + x)) / range;
}

double decode(const ColorLut& lut, double encoded) noexcept
{
    const double x = encoded * std::log2(1 + double(lut.maximum) / lut.delta);
    return lut.delta * (x < 0 ? x * std::numbers::ln2 : std::exp2(x) - 1);
}

std::array<double, 3> apply(const ColorLut& lut, const std::array<double, 3>& linear) noexcept
{
    if (lut.size < 2) return linear;
    Color encoded, f;
    std::array<int, 3> cell;
    for (int k = 0; k < 3; ++k) {
        encoded[k] = encode(lut, linear[k]);
        const double inside = encoded[k] > 0 ? std::min(encoded[k], 1.0) : 0;  // NaN falls to 0
        const double x = inside * (lut.size - 1);
        cell[k] = std::min(int(x), lut.size - 2);
        f[k] = x - cell[k];
    }
    for (int corner = 0; corner < 8; ++corner) {
        double w = 1;
        std::size_t node = 0;
        for (int k = 2; k >= 0; --k) {
            const int bit = corner >> k & 1;
            w *= bit ? f[k] : 1 - f[k];
            node = node * lut.size + cell[k] + bit;
        }
        for (int k = 0; k < 3; ++k) encoded[k] += w * lut.rgb[3 * node + k];
    }
    return {decode(lut, encoded[0]), decode(lut, encoded[1]), decode(lut, encoded[2])};
}

ColorLut makeColorTransfer(const std::vector<ConstImageViewF>& plate, ConstImageViewF reference,
                           const ColorTransferOptions& options)
{
    const auto require = [](bool holds, const char* name, double value, const char* allowed) {
        if (!holds)
            throw Error(ErrorCode::InvalidArgument, "colour transfer: {} = {} is out of range ({})", name, value,
                        allowed);
    };
    require(options.strength >= 0 && options.strength <= 1, "strength", options.strength, "0..1");
    require(options.size >= 2 && options.size <= 129, "size", options.size, "2..129");
    require(options.samples >= 100, "samples", options.samples, "at least 100");
    require(options.iterations >= 1, "iterations", options.iterations, "at least 1");
    require(options.maxSlope >= 1, "maxSlope", options.maxSlope, "at least 1");
    require(options.smoothness >= 1e-3 && options.smoothness <= 1e3, "smoothness", options.smoothness, "0.001..1000");

    std::vector<Color> from = samplePixels(plate, options.samples, "plate");
    std::vector<Color> to = samplePixels({reference}, options.samples, "reference");
    ColorLut lut;
    lut.size = options.size;
    // The table spans what the plate and the reference hold, at least 0..1 and at most 10 stops more.
    double brightest = 1;
    for (const std::vector<Color>* colors : {&from, &to})
        for (const Color& c : *colors) brightest = std::max({brightest, c[0], c[1], c[2]});
    lut.maximum = float(std::min(brightest, 1024.0));
    for (std::vector<Color>* colors : {&from, &to})
        for (Color& c : *colors)
            for (double& value : c) value = encode(lut, value);

    const std::vector<Color> moved = transferred(from, to, options.iterations);
    Nodes nodes(options.size, options.smoothness);
    for (std::size_t i = 0; i < from.size(); ++i) {
        Color move;
        for (int k = 0; k < 3; ++k) move[k] = moved[i][k] - from[i][k];
        nodes.add(from[i], move);
    }
    nodes.finish(2e-4 * double(from.size()));
    double share = 0;
    for (int round = 0; round < kRounds && share < 1; ++round) {
        nodes.solve();
        share = nodes.stiffen(options.maxSlope);
    }
    if (share < 1) nodes.shrink(share);

    lut.rgb.resize(3 * nodes.count());
    for (std::size_t node = 0; node < nodes.count(); ++node) {
        std::size_t rest = node;
        for (int k = 0; k < 3; ++k, rest /= std::size_t(lut.size)) {
            // No light below zero: a node moves down to black at most, and between nodes it interpolates.
            const double place = double(rest % std::size_t(lut.size)) / (lut.size - 1);
            lut.rgb[3 * node + k] = float(std::max(options.strength * nodes.channel(k)[node], -place));
        }
    }
    return lut;
}

}  // namespace virga::grade
