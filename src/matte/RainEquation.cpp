#include "matte/RainEquation.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <memory>
#include <type_traits>
#include <vector>

#include "core/Parallel.h"
#include "core/Simd.h"
#include "matte/PixelRows.h"

namespace virga::matte {
namespace {

constexpr int mostSteps = 500;
constexpr std::ptrdiff_t rowsTogether = 8;  // the least worth another thread

/// From here on a tolerance is one that float meets.
constexpr double floatTolerance = 1e-5;

// ---------------------------------------------------------------------------------------------------------------------
// Loops over the values of a row that keep a sum. A term is a struct with at(i, left, right, sum), which adds to `sum`
// what value i gives, or the values of a pack from i on (P: OneOf or PackOf). left and right: the values beside, a
// pixel away, or i itself where the row ends.

/// Whole packs where both neighbours are inside, four sums in turn so that none waits for itself; then the rest.
template <class Real, class Term>
VIRGA_INLINE double sumRow(const Term& term, int count, int pixel)
{
    constexpr int lanes = PackOf<Real>::lanes, turns = 4;
    typename PackOf<Real>::Type sums[turns] = {};
    Real rest = 0;
    int i = 0;
    for (; i < std::min(pixel, count); ++i)
        term.template at<OneOf<Real>>(i, i, i + pixel < count ? i + pixel : i, rest);
    for (; i + turns * lanes <= count - pixel; i += turns * lanes)
        for (int t = 0; t < turns; ++t) {
            const int at = i + t * lanes;
            term.template at<PackOf<Real>>(at, at - pixel, at + pixel, sums[t]);
        }
    for (; i < count; ++i) term.template at<OneOf<Real>>(i, i - pixel, i + pixel < count ? i + pixel : i, rest);
    double total = rest;
    for (int l = 0; l < lanes; ++l)
        total += (double(sums[0][l]) + double(sums[1][l])) + (double(sums[2][l]) + double(sums[3][l]));
    return total;
}

/// The sums over rows of body(row), whose order does not depend on threads.
template <std::size_t count, class Body>
std::array<double, count> sumOverRows(std::ptrdiff_t rows, const Body& body)
{
    std::vector<std::array<double, count>> sums(static_cast<std::size_t>(rows));
    parallelFor(0, rows, rowsTogether,
                [&](std::ptrdiff_t first, std::ptrdiff_t last) { body(first, last, sums.data()); });
    std::array<double, count> sum{};
    for (const auto& row : sums)
        for (std::size_t n = 0; n < count; ++n) sum[n] += row[n];
    return sum;
}

// What is one number a pixel, alpha or a trust, is first written once for each channel, so that loops run over values.

/// Rows of one frame after another, repeated for each channel; without a trust a row of ones.
struct FrameRows {
    FrameRows(const Footage& footage, const ImageF& scene, const RainTerms& terms)
        : color(std::size_t(scene.width()) * std::size_t(scene.channels())), alpha(color.size()),
          trust(color.size(), 1.0f), footage_(footage), width_(scene.width()), channels_(scene.channels())
    {
        assert(channels_ == 1 || channels_ == 3);
        for (std::size_t i = 0; i < color.size(); ++i) color[i] = terms.color[i % std::size_t(channels_)];
    }

    void read(std::size_t k, const ImageF& alphaOf, int y)
    {
        repeatRow(alphaOf.row(y), width_, channels_, alpha.data());
        if (!footage_.trust.empty()) repeatRow(footage_.trust[k].row(y), width_, channels_, trust.data());
    }

    std::vector<float> color, alpha, trust;

private:
    const Footage& footage_;
    int width_, channels_;
};

// ---------------------------------------------------------------------------------------------------------------------
// F. The difference to explain is (I - S) - alpha (C - S): what is small is not lost beside what is large.

struct Unexplained {
    const float *frame, *scene, *alpha, *color, *trust;

    template <class P>
    VIRGA_INLINE void at(int i, int, int, typename P::Type& sum) const
    {
        using T = typename P::Type;
        const T here = P::at(scene + i);
        const T off = (P::at(frame + i) - here) - P::at(alpha + i) * (P::at(color + i) - here);
        sum += P::at(trust + i) * (off * off);
    }
};

/// (s dx + c dy)^2, forward differences.
struct Along {
    const float *here, *below;
    float s, c;

    template <class P>
    VIRGA_INLINE void at(int i, int, int right, typename P::Type& sum) const
    {
        using T = typename P::Type;
        const T value = P::at(here + i);
        const T along = s * (P::at(here + right) - value) + c * (P::at(below + i) - value);
        sum += along * along;
    }
};

/// dx^2 + dy^2, forward differences.
struct Slopes {
    const float *here, *below;

    template <class P>
    VIRGA_INLINE void at(int i, int, int right, typename P::Type& sum) const
    {
        using T = typename P::Type;
        const T value = P::at(here + i), dx = P::at(here + right) - value, dy = P::at(below + i) - value;
        sum += dx * dx + dy * dy;
    }
};

struct Product {
    const float *a, *b;

    template <class P>
    VIRGA_INLINE void at(int i, int, int, typename P::Type& sum) const
    {
        sum += P::at(a + i) * P::at(b + i);
    }
};

VIRGA_SIMD double rowSum(const Unexplained& term, int count, int pixel) { return sumRow<float>(term, count, pixel); }
VIRGA_SIMD double rowSum(const Along& term, int count, int pixel) { return sumRow<float>(term, count, pixel); }
VIRGA_SIMD double rowSum(const Slopes& term, int count, int pixel) { return sumRow<float>(term, count, pixel); }
VIRGA_SIMD double rowSum(const Product& term, int count, int pixel) { return sumRow<float>(term, count, pixel); }

/// Row y + 1, or y where that is the last: a difference that leaves the picture is 0.
const float* rowBelow(const ImageF& image, int y) { return image.row(std::min(y + 1, image.height() - 1)); }

// ---------------------------------------------------------------------------------------------------------------------
// The scene's equation, (diag(weight) + lambda Laplacian) S = right, solved for what S is to change by: the residual is
// small and comes out of differences, so that float holds it.

/// Adds a frame's row: weight += w (1 - alpha)^2, residual += w (1 - alpha) ((I - S) - alpha (C - S)).
template <class Real>
VIRGA_INLINE void addFrameAny(const Unexplained& row, int count, Real* __restrict weight, Real* __restrict residual)
{
    const float *frame = row.frame, *scene = row.scene, *alpha = row.alpha, *color = row.color, *trust = row.trust;
    for (int i = 0; i < count; ++i) {
        const Real a = alpha[i], s = scene[i], seen = Real(trust[i]) * (1 - a);
        weight[i] += seen * (1 - a);
        residual[i] += seen * ((frame[i] - s) - a * (color[i] - s));
    }
}
VIRGA_SIMD void addFrame(const Unexplained& row, int count, float* weight, float* residual)
{
    addFrameAny(row, count, weight, residual);
}
VIRGA_SIMD void addFrame(const Unexplained& row, int count, double* weight, double* residual)
{
    addFrameAny(row, count, weight, residual);
}

/// The sum of squares of the equation's right side.
template <class Real>
struct RightSide {
    const Real *weight, *value, *residual;

    template <class P>
    VIRGA_INLINE void at(int i, int, int, typename P::Type& sum) const
    {
        using T = typename P::Type;
        const T right = P::at(residual + i) + P::at(weight + i) * P::at(value + i);
        sum += right * right;
    }
};

/// lambda times the Laplacian; no sum, it gives what it finds.
template <class Real>
struct Bend {
    const Real *value, *above, *below;
    Real lambda;

    template <class P>
    VIRGA_INLINE void at(int i, int left, int right, typename P::Type& to) const
    {
        using T = typename P::Type;
        const T here = P::at(value + i);
        to = lambda * (((here - P::at(value + left)) + (here - P::at(value + right))) +
                       ((here - P::at(above + i)) + (here - P::at(below + i))));
    }
};

/// The scene's own part of the residual.
template <class Real>
struct Begin {
    Bend<Real> bend;
    Real* residual;

    template <class P>
    VIRGA_INLINE void at(int i, int left, int right, typename P::Type& sum) const
    {
        using T = typename P::Type;
        T bent;
        bend.template at<P>(i, left, right, bent);
        const T off = P::at(residual + i) - bent;
        P::at(residual + i) = off;
        sum += off * off;
    }
};

/// image = A direction; the sum of their products.
template <class Real>
struct Multiply {
    Bend<Real> bend;
    const Real* weight;
    Real* image;

    template <class P>
    VIRGA_INLINE void at(int i, int left, int right, typename P::Type& sum) const
    {
        using T = typename P::Type;
        const T here = P::at(bend.value + i);
        T product;
        bend.template at<P>(i, left, right, product);
        product += P::at(weight + i) * here;
        P::at(image + i) = product;
        sum += product * here;
    }
};

/// A step along the direction; the sum of the residual's squares.
template <class Real>
struct Step {
    const Real *direction, *image;
    Real *value, *residual;
    Real length;

    template <class P>
    VIRGA_INLINE void at(int i, int, int, typename P::Type& sum) const
    {
        using T = typename P::Type;
        P::at(value + i) += length * P::at(direction + i);
        const T off = P::at(residual + i) - length * P::at(image + i);
        P::at(residual + i) = off;
        sum += off * off;
    }
};

/// The residual over the diagonal, about: `around` stands for the neighbours' part everywhere. Where the matrix has
/// nothing the residual is 0, and stays.
template <class Real>
struct Preconditioned {
    const Real *weight, *residual;
    Real around;

    template <class P>
    VIRGA_INLINE void at(int i, int, int, typename P::Type& sum) const
    {
        using T = typename P::Type;
        const T off = P::at(residual + i);
        sum += off * off / (P::at(weight + i) + around);
    }
};

/// The next direction: the preconditioned residual, and a share of the last direction. No sum.
template <class Real>
struct Turn {
    const Real *weight, *residual;
    Real* direction;
    Real around, share;

    template <class P>
    VIRGA_INLINE void at(int i, int, int, typename P::Type&) const
    {
        P::at(direction + i) = P::at(residual + i) / (P::at(weight + i) + around) + share * P::at(direction + i);
    }
};

#define VIRGA_ROW_SUMS(Term)                                                 \
    VIRGA_SIMD double rowSum(const Term<float>& term, int count, int pixel)  \
    {                                                                        \
        return sumRow<float>(term, count, pixel);                            \
    }                                                                        \
    VIRGA_SIMD double rowSum(const Term<double>& term, int count, int pixel) \
    {                                                                        \
        return sumRow<double>(term, count, pixel);                           \
    }
VIRGA_ROW_SUMS(RightSide)
VIRGA_ROW_SUMS(Begin)
VIRGA_ROW_SUMS(Multiply)
VIRGA_ROW_SUMS(Step)
VIRGA_ROW_SUMS(Preconditioned)
VIRGA_ROW_SUMS(Turn)
#undef VIRGA_ROW_SUMS

/// Keeps quotients finite where neither the data nor lambda has a say; nothing beside any weight.
constexpr double nothing = 1e-30;

template <class Real>
class SceneEquation {
public:
    SceneEquation(const Footage& footage, std::span<const ImageF> alphas, const RainTerms& terms, ImageF& scene)
        : footage_(footage), alphas_(alphas), terms_(terms), scene_(scene), width_(scene.width()),
          channels_(scene.channels()), height_(scene.height()), row_(std::ptrdiff_t(width_) * channels_),
          lambda_(Real(terms.lambda)), around_(Real(4.0 * terms.lambda + nothing)), weight_(room()), residual_(room()),
          direction_(room()), image_(room())
    {
        if constexpr (std::is_same_v<Real, float>) {
            value_ = scene.data();
        } else {
            copy_.assign(scene.data(), scene.data() + scene.size());
            value_ = copy_.data();
        }
    }

    /// Conjugate gradients, all channels together, preconditioned with the diagonal.
    void solve(double tolerance)
    {
        const int count = int(row_);
        auto [scale, left, along] = begin();
        Real share = 0;
        for (int step = 0; step < mostSteps && left > tolerance * tolerance * scale; ++step) {
            parallelFor(0, height_, rowsTogether, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
                for (int y = int(first); y < int(last); ++y)
                    rowSum(Turn<Real>{at(weight_, y), at(residual_, y), at(direction_, y), around_, share}, count,
                           channels_);
            });
            const auto [curvature] = overRows<1>([&](int y, auto& sums) {
                sums[0] =
                    rowSum(Multiply<Real>{bend(direction_.get(), y), at(weight_, y), at(image_, y)}, count, channels_);
            });
            if (!(curvature > 0.0)) break;
            const Real length = Real(along / curvature);
            const auto [nowLeft, nowAlong] = overRows<2>([&](int y, auto& sums) {
                sums[0] =
                    rowSum(Step<Real>{at(direction_, y), at(image_, y), value_ + y * row_, at(residual_, y), length},
                           count, channels_);
                sums[1] = rowSum(Preconditioned<Real>{at(weight_, y), at(residual_, y), around_}, count, channels_);
            });
            left = nowLeft;
            share = Real(nowAlong / along);
            along = nowAlong;
        }
        if constexpr (!std::is_same_v<Real, float>)
            std::transform(copy_.begin(), copy_.end(), scene_.data(), [](Real value) { return float(value); });
    }

private:
    using Room = std::unique_ptr<Real[]>;

    Room room() const { return std::make_unique_for_overwrite<Real[]>(scene_.size()); }
    Real* at(const Room& room, int y) const { return room.get() + y * row_; }
    Bend<Real> bend(const Real* values, int y) const
    {
        return {values + y * row_, values + std::max(y - 1, 0) * row_, values + std::min(y + 1, height_ - 1) * row_,
                lambda_};
    }

    /// body(row, its sums).
    template <std::size_t count, class Body>
    std::array<double, count> overRows(const Body& body) const
    {
        return sumOverRows<count>(height_, [&](std::ptrdiff_t first, std::ptrdiff_t last, auto* sums) {
            for (std::ptrdiff_t y = first; y < last; ++y) body(int(y), sums[y]);
        });
    }

    /// Weights and residual, in one pass over the footage: the squares' sums of the right side and of the residual, and
    /// the residual's with itself preconditioned.
    std::array<double, 3> begin()
    {
        const int count = int(row_);
        return sumOverRows<3>(height_, [&](std::ptrdiff_t first, std::ptrdiff_t last, auto* sums) {
            FrameRows rows(footage_, scene_, terms_);
            for (int y = int(first); y < int(last); ++y) {
                Real *weight = at(weight_, y), *residual = at(residual_, y);
                std::fill_n(weight, row_, Real(0));
                std::fill_n(residual, row_, Real(0));
                std::fill_n(at(direction_, y), row_, Real(0));
                for (std::size_t k = 0; k < alphas_.size(); ++k) {
                    rows.read(k, alphas_[k], y);
                    addFrame({footage_.frames[k].row(y), scene_.row(y), rows.alpha.data(), rows.color.data(),
                              rows.trust.data()},
                             count, weight, residual);
                }
                sums[y] = {rowSum(RightSide<Real>{weight, value_ + y * row_, residual}, count, channels_),
                           rowSum(Begin<Real>{bend(value_, y), residual}, count, channels_),
                           rowSum(Preconditioned<Real>{weight, residual, around_}, count, channels_)};
            }
        });
    }

    const Footage& footage_;
    std::span<const ImageF> alphas_;
    const RainTerms& terms_;
    ImageF& scene_;
    int width_, channels_, height_;
    std::ptrdiff_t row_;
    Real lambda_, around_;
    Room weight_, residual_, direction_, image_;
    std::vector<Real> copy_;
    Real* value_;
};

}  // namespace

// ---------------------------------------------------------------------------------------------------------------------

RainObjective rainObjective(const Footage& footage, const ImageF& scene, std::span<const ImageF> alphas,
                            const RainTerms& terms)
{
    assert(footage.frames.size() == alphas.size());
    const int width = scene.width(), height = scene.height(), channels = scene.channels();
    const int count = width * channels;
    const float s = float(std::sin(terms.slant)), c = float(std::cos(terms.slant));
    const std::vector<float> ones(std::size_t(width), 1.0f);
    // Data, rain, cost: of all rows of all frames.
    const auto sums = sumOverRows<3>(
        std::ptrdiff_t(alphas.size()) * height, [&](std::ptrdiff_t first, std::ptrdiff_t last, auto* rowSums) {
            FrameRows rows(footage, scene, terms);
            for (std::ptrdiff_t n = first; n < last; ++n) {
                const auto k = std::size_t(n / height);
                const int y = int(n % height);
                const ImageF& alpha = alphas[k];
                rows.read(k, alpha, y);
                rowSums[n] = {rowSum(Unexplained{footage.frames[k].row(y), scene.row(y), rows.alpha.data(),
                                                 rows.color.data(), rows.trust.data()},
                                     count, channels),
                              rowSum(Along{alpha.row(y), rowBelow(alpha, y), s, c}, width, 1),
                              rowSum(Product{alpha.row(y), footage.cost.empty() ? ones.data() : footage.cost[k].row(y)},
                                     width, 1)};
            }
        });
    const auto [slopes] = sumOverRows<1>(height, [&](std::ptrdiff_t first, std::ptrdiff_t last, auto* rowSums) {
        for (int y = int(first); y < int(last); ++y)
            rowSums[y] = {rowSum(Slopes{scene.row(y), rowBelow(scene, y)}, count, channels)};
    });
    return {sums[0], terms.lambda * slopes, terms.mu * sums[1], 2.0 * terms.eta * sums[2]};
}

void solveScene(const Footage& footage, std::span<const ImageF> alphas, const RainTerms& terms, ImageF& scene,
                double tolerance)
{
    assert(footage.frames.size() == alphas.size());
    if (tolerance >= floatTolerance)
        SceneEquation<float>(footage, alphas, terms, scene).solve(tolerance);
    else
        SceneEquation<double>(footage, alphas, terms, scene).solve(tolerance);
}

}  // namespace virga::matte
