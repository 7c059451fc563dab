#include "matte/BoundedLines.h"

#include <algorithm>

#include "core/Simd.h"

namespace virga::matte {
namespace {

constexpr int mostSetChanges = 40;
constexpr int sweepsInstead = 200;

/// The rows of a block as packs, entry i's from i * packs on; none overlaps another.
template <class Real>
struct Lines {
    using Pack = typename PackOf<Real>::Type;
    static constexpr int packs = LineBlock<Real>::lanes / PackOf<Real>::lanes;

    int length;
    const Pack* __restrict coupling;
    const Pack* __restrict own;
    const Pack* __restrict pull;
    Pack* __restrict value;
    Pack* __restrict factor;
    Pack* __restrict reduced;
    Pack* __restrict trial;

    explicit Lines(LineBlock<Real>& block)
        : length(block.length()), coupling(reinterpret_cast<const Pack*>(&block.coupling)), own(rows(block.own)),
          pull(rows(block.pull)), value(rows(block.value)), factor(rows(block.factor)), reduced(rows(block.reduced)),
          trial(rows(block.trial))
    {
    }

private:
    template <class Rows>
    static Pack* rows(Rows& rows)
    {
        return reinterpret_cast<Pack*>(rows.data());
    }
};

// Elimination carries, instead of the pivot, what it has over the coupling to the next entry. That is a sum of positive
// numbers, over_i = own_i + coupling over_i-1 / (over_i-1 + coupling), in which nothing cancels, be the coupling ever
// so strong (Grassmann, Taksar & Heyman 1985).

template <class Real>
VIRGA_INLINE void solveFree(const Lines<Real>& lines)
{
    using Pack = typename Lines<Real>::Pack;
    constexpr int packs = Lines<Real>::packs;
    const int n = lines.length;
    Pack carried[packs] = {}, reduced[packs] = {}, next[packs] = {};
    for (int i = 0; i < n; ++i) {
        const Real after = i + 1 < n ? Real(1) : Real(0);
        for (int p = 0; p < packs; ++p) {
            const int at = i * packs + p;
            const Pack coupling = lines.coupling[p], over = lines.own[at] + carried[p];
            const Pack inverse = Real(1) / (over + after * coupling);
            lines.factor[at] = coupling * inverse;
            reduced[p] = (lines.pull[at] + coupling * reduced[p]) * inverse;
            lines.reduced[at] = reduced[p];
            carried[p] = coupling * (over * inverse);
        }
    }
    for (int i = n - 1; i >= 0; --i)
        for (int p = 0; p < packs; ++p) {
            const int at = i * packs + p;
            next[p] = lines.reduced[at] + lines.factor[at] * next[p];
            lines.value[at] = next[p];
        }
}

template <class Real>
struct Bounds {
    Real low, high, slack;
};

template <class Pack>
VIRGA_INLINE void raise(Pack& value, const Pack& to)
{
    value = value < to ? to : value;
}

/// What becomes of the entry `at`, whose value with the sets of before is `here`: on or beyond a bound, it is held
/// there from now on; held by `trial` where the slope pulls it inwards, it goes to the middle, which is on no bound.
/// Raises `worst` to how much more than the slack this was needed.
template <class Real, class Pack>
VIRGA_INLINE void judge(const Lines<Real>& lines, int at, const Pack& coupling, const Pack& above, const Pack& here,
                        const Pack& below, const Bounds<Real>& bounds, Pack& worst)
{
    const Pack zero = {};
    const Pack low = zero + bounds.low, high = zero + bounds.high, middle = (low + high) * Real(0.5);
    const Pack own = lines.own[at], was = lines.trial[at];
    const Pack slope = own * here - lines.pull[at] + coupling * ((here - above) + (here - below));
    const Pack inwards = was <= low ? -slope : was >= high ? slope : zero;
    const Pack inside = inwards - bounds.slack * (own + Real(2) * coupling);
    const Pack raised = here < low ? low : here;
    const Pack clamped = raised > high ? high : raised;
    lines.trial[at] = inside > zero ? middle : clamped;
    raise<Pack>(worst, inside);
    raise<Pack>(worst, low - here - bounds.slack);
    raise<Pack>(worst, here - high - bounds.slack);
}

/// One step of the active sets that `trial` has on its bounds. True when they hold.
template <class Real>
VIRGA_INLINE bool step(const Lines<Real>& lines, const Bounds<Real>& bounds)
{
    using Pack = typename Lines<Real>::Pack;
    constexpr int packs = Lines<Real>::packs;
    const int n = lines.length;
    const Pack zero = {};
    Pack carried[packs] = {}, reduced[packs] = {};
    for (int i = 0; i < n; ++i) {
        const Real after = i + 1 < n ? Real(1) : Real(0);
        for (int p = 0; p < packs; ++p) {
            const int at = i * packs + p;
            const Pack coupling = lines.coupling[p], over = lines.own[at] + carried[p], x = lines.trial[at];
            const Pack inverse = Real(1) / (over + after * coupling);
            const Pack solved = (lines.pull[at] + coupling * reduced[p]) * inverse;
            const auto isHeld = (x <= bounds.low) | (x >= bounds.high);
            lines.factor[at] = isHeld ? zero : coupling * inverse;
            reduced[p] = isHeld ? x : solved;
            lines.reduced[at] = reduced[p];
            carried[p] = isHeld ? coupling : coupling * (over * inverse);
        }
    }
    Pack worst[packs] = {}, here[packs], below[packs];
    for (int p = 0; p < packs; ++p) here[p] = below[p] = reduced[p];
    for (int i = n - 2; i >= 0; --i)
        for (int p = 0; p < packs; ++p) {
            const int at = i * packs + p;
            const Pack above = lines.reduced[at] + lines.factor[at] * here[p];
            judge<Real, Pack>(lines, at + packs, lines.coupling[p], above, here[p], below[p], bounds, worst[p]);
            below[p] = here[p];
            here[p] = above;
        }
    bool holds = true;
    for (int p = 0; p < packs; ++p) {
        judge<Real, Pack>(lines, p, lines.coupling[p], here[p], here[p], below[p], bounds, worst[p]);
        for (int l = 0; l < PackOf<Real>::lanes; ++l) holds &= !(worst[p][l] > 0);
    }
    return holds;
}

/// The sets to begin with: `trial` from `value`, without what the slope pulls off a bound.
template <class Real>
VIRGA_INLINE void begin(const Lines<Real>& lines, const Bounds<Real>& bounds)
{
    using Pack = typename Lines<Real>::Pack;
    constexpr int packs = Lines<Real>::packs;
    const int n = lines.length;
    Pack unused = {};
    for (int i = 0; i < n; ++i)
        for (int p = 0; p < packs; ++p) {
            const int at = i * packs + p;
            const Pack here = lines.value[at], above = lines.value[i > 0 ? at - packs : at],
                       below = lines.value[i + 1 < n ? at + packs : at];
            lines.trial[at] = here;
            judge<Real, Pack>(lines, at, lines.coupling[p], above, here, below, bounds, unused);
        }
}

/// One sweep of projected Gauss-Seidel over the values.
template <class Real>
VIRGA_INLINE void sweep(const Lines<Real>& lines, const Bounds<Real>& bounds)
{
    using Pack = typename Lines<Real>::Pack;
    constexpr int packs = Lines<Real>::packs;
    const int n = lines.length;
    const Pack zero = {}, low = zero + bounds.low, high = zero + bounds.high;
    for (int i = 0; i < n; ++i)
        for (int p = 0; p < packs; ++p) {
            const int at = i * packs + p;
            const Pack coupling = lines.coupling[p];
            Pack right = lines.pull[at], diagonal = lines.own[at];
            if (i > 0) {
                right += coupling * lines.value[at - packs];
                diagonal += coupling;
            }
            if (i + 1 < n) {
                right += coupling * lines.value[at + packs];
                diagonal += coupling;
            }
            const Pack x = right / diagonal, raised = x < low ? low : x;
            lines.value[at] = raised > high ? high : raised;
        }
}

/// True when `trial` has the minimiser, false when `value` has what the sweeps came to.
template <class Real>
VIRGA_INLINE bool solveSets(const Lines<Real>& lines, const Bounds<Real>& bounds)
{
    begin(lines, bounds);
    for (int change = 0; change < mostSetChanges; ++change)
        if (step(lines, bounds)) return true;
    for (int pass = 0; pass < sweepsInstead; ++pass) sweep(lines, bounds);
    return false;
}

VIRGA_SIMD void freeLines(const Lines<float>& lines) { solveFree(lines); }
VIRGA_SIMD void freeLines(const Lines<double>& lines) { solveFree(lines); }
VIRGA_SIMD bool boundedLines(const Lines<float>& lines, const Bounds<float>& bounds)
{
    return solveSets(lines, bounds);
}
VIRGA_SIMD bool boundedLines(const Lines<double>& lines, const Bounds<double>& bounds)
{
    return solveSets(lines, bounds);
}

}  // namespace

template <class Real>
void LineBlock<Real>::resize(int length)
{
    for (auto* rows : {&own, &pull, &value, &factor, &reduced, &trial}) rows->resize(std::size_t(length));
}

template <class Real>
void solveLines(LineBlock<Real>& block)
{
    if (block.length() > 0) freeLines(Lines<Real>(block));
}

template <class Real>
void solveLines(LineBlock<Real>& block, Real low, Real high, Real slack)
{
    if (block.length() > 0 && boundedLines(Lines<Real>(block), {low, high, slack})) block.value.swap(block.trial);
}

template struct LineBlock<float>;
template struct LineBlock<double>;
template void solveLines(LineBlock<float>&);
template void solveLines(LineBlock<double>&);
template void solveLines(LineBlock<float>&, float, float, float);
template void solveLines(LineBlock<double>&, double, double, double);

}  // namespace virga::matte
