// The alpha step of RainEquation.h.
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>

#include "core/Parallel.h"
#include "core/Simd.h"
#include "matte/BoundedLines.h"
#include "matte/ColumnPlane.h"
#include "matte/FreeAlpha.h"

namespace virga::matte {
namespace {

/// From here on a tolerance is one that float meets.
constexpr double floatTolerance = 1e-5;

template <class Real>
VIRGA_INLINE void clampAny(const float* __restrict row, int width, Real* __restrict to)
{
    for (int x = 0; x < width; ++x) {
        const float raised = row[x] > 0.0f ? row[x] : 0.0f;
        to[x] = raised < 1.0f ? raised : 1.0f;
    }
}
VIRGA_SIMD void clamp(const float* row, int width, float* to) { clampAny(row, width, to); }
VIRGA_SIMD void clamp(const float* row, int width, double* to) { clampAny(row, width, to); }

/// One block's part of the planes. `beside` has the column to the left of lane 0 first.
template <class Real>
struct BlockRows {
    int rows;
    std::ptrdiff_t stride;
    const Real *seen, *pull, *beside;
    Real* alpha;
    const Real *ownFirst, *ownMiddle, *ownLast;  // what coupling adds to `seen`, by row
    Real right, rightLast, cross;                // of the columns beside

    /// What the block starts from.
    VIRGA_INLINE void fill(LineBlock<Real>& block) const
    {
        for (int y = 0; y < rows; ++y) {
            const Real* own = y == 0 ? ownFirst : y + 1 < rows ? ownMiddle : ownLast;
            const Real level = y + 1 < rows ? right : rightLast;
            for (int l = 0; l < block.lanes; l += PackOf<Real>::lanes) {
                const std::ptrdiff_t at = y * stride + l;
                const Real* left = beside + at;
                const Pack level2 = P::at(left) + P::at(left + 1);
                const Pack cross2 = P::at(left + stride) + P::at(left + 1 - stride);
                P::at(&block.own[y][l]) = P::at(seen + at) + P::at(own + l);
                P::at(&block.pull[y][l]) = P::at(pull + at) - level * level2 - cross * cross2;
                P::at(&block.value[y][l]) = P::at(alpha + at);
            }
        }
    }
    /// Takes over what the block came to; moved: by how much, at most.
    VIRGA_INLINE void take(const LineBlock<Real>& block, typename LineBlock<Real>::Row& moved) const
    {
        for (int l = 0; l < block.lanes; l += PackOf<Real>::lanes) {
            Pack most = {};
            for (int y = 0; y < rows; ++y) {
                typename P::Loose& to = P::at(alpha + y * stride + l);
                const Pack now = P::at(&block.value[y][l]), step = now - to;
                most = most < step ? step : most;
                most = most < -step ? -step : most;
                to = now;
            }
            P::at(&moved[l]) = most;
        }
    }

private:
    using P = PackOf<Real>;
    using Pack = typename P::Type;
};

VIRGA_SIMD void fillBlock(const BlockRows<float>& rows, LineBlock<float>& block) { rows.fill(block); }
VIRGA_SIMD void fillBlock(const BlockRows<double>& rows, LineBlock<double>& block) { rows.fill(block); }
VIRGA_SIMD void takeBlock(const BlockRows<float>& rows, const LineBlock<float>& block, LineBlock<float>::Row& moved)
{
    rows.take(block, moved);
}
VIRGA_SIMD void takeBlock(const BlockRows<double>& rows, const LineBlock<double>& block, LineBlock<double>::Row& moved)
{
    rows.take(block, moved);
}

/// Solves one frame after another in the same room: three planes and a block.
template <class Real>
class BoundedAlpha {
public:
    BoundedAlpha(int width, int height, const RainTerms& terms)
        : matrix_(width, height, terms.slant), mu_(terms.mu), seen_(matrix_), pull_(matrix_), alpha_(matrix_),
          block_(matrix_.rows), waiting_(std::size_t(matrix_.columns) + 2)
    {
        for (int parity = 0; parity < 2; ++parity) {
            Couplings& of = couplings_[std::size_t(parity)];
            of.column.assign(std::size_t(seen_.blocks() * lanes), Real(0));
            of.ownFirst.assign(of.column.size(), Real(1));
            of.ownMiddle = of.ownLast = of.ownFirst;
            for (int x = parity; x < matrix_.columns; x += 2) {
                const auto j = std::size_t(x / 2);
                const auto own = [&](int y) { return Real(alphaRidge + mu_ * matrix_.own(x, y)); };
                of.column[j] = Real(mu_ * matrix_.coupling(x));
                of.ownFirst[j] = own(0);
                of.ownMiddle[j] = own(std::min(1, matrix_.rows - 1));
                of.ownLast[j] = own(matrix_.rows - 1);
            }
        }
    }

    /// Even columns, odd columns, each exactly with its neighbours held, until none has a neighbour that moved since.
    void solve(const FrameData& data, ImageF& alpha, double tolerance)
    {
        const int width = alpha.width(), height = alpha.height();
        constexpr int together = ColumnPlane<Real>::rowsTogether;
        std::vector<Real> seen(std::size_t(width) * together), pull = seen, start = seen;
        for (int y = 0; y < height; y += together) {
            const int count = std::min(together, height - y);
            for (int t = 0; t < count; ++t) {
                data.ask(y + t, seen.data() + t * width, pull.data() + t * width);
                clamp(alpha.row(y + t), width, start.data() + t * width);
            }
            seen_.put(y, count, seen.data());
            pull_.put(y, count, pull.data());
            alpha_.put(y, count, start.data());
        }
        std::fill(waiting_.begin(), waiting_.end(), std::numeric_limits<Real>::infinity());
        bool isSettled = false;
        for (int step = 0; step < mostAlphaSteps && !isSettled; ++step) {
            isSettled = true;
            for (int parity = 0; parity < 2; ++parity)
                for (int block = 0; block < seen_.blocks(); ++block) isSettled &= !turn(parity, block, Real(tolerance));
        }
        for (int y = 0; y < height; y += together) alpha_.get(y, std::min(together, height - y), alpha.row(y));
    }

private:
    static constexpr int lanes = LineBlock<Real>::lanes;

    struct Couplings {
        std::vector<Real> column, ownFirst, ownMiddle, ownLast;
    };

    /// Solves the block if a column in it waits for it; true if so.
    bool turn(int parity, int block, Real tolerance)
    {
        const int first = 2 * block * lanes + parity, end = std::min(matrix_.columns, first + 2 * lanes);
        bool isWaiting = false;
        for (int x = first; x < end; x += 2) isWaiting |= waiting_[std::size_t(x + 1)] > tolerance;
        if (!isWaiting) return false;

        const Couplings& of = couplings_[std::size_t(parity)];
        const std::ptrdiff_t at = std::ptrdiff_t(block) * lanes;
        std::copy_n(of.column.begin() + at, lanes, block_.coupling.begin());
        const BlockRows<Real> rows{matrix_.rows,
                                   seen_.stride(),
                                   seen_.row(0, parity) + at,
                                   pull_.row(0, parity) + at,
                                   alpha_.row(0, 1 - parity) + at + parity - 1,
                                   alpha_.row(0, parity) + at,
                                   of.ownFirst.data() + at,
                                   of.ownMiddle.data() + at,
                                   of.ownLast.data() + at,
                                   Real(mu_ * matrix_.right(0)),
                                   Real(mu_ * matrix_.right(matrix_.rows - 1)),
                                   Real(mu_ * matrix_.cross())};
        fillBlock(rows, block_);
        solveLines(block_, Real(0), Real(1), tolerance >= Real(floatTolerance) ? tolerance / 20 : Real(0));
        typename LineBlock<Real>::Row moved;
        takeBlock(rows, block_, moved);
        // Lanes that are no columns stay 0, because the column before them looks there.
        if (const int count = (end - first + 1) / 2; count < lanes)
            for (int y = 0; y < matrix_.rows; ++y)
                std::fill_n(alpha_.row(y, parity) + at + count, lanes - count, Real(0));
        for (int x = first; x < end; x += 2) waiting_[std::size_t(x + 1)] = 0;
        const Real follows = Real(std::abs(matrix_.s) / (std::abs(matrix_.s) + std::abs(matrix_.c)));
        for (int x = first; x < end; x += 2) {
            const Real by = follows * moved[std::size_t((x - first) / 2)];
            waiting_[std::size_t(x)] += by;
            waiting_[std::size_t(x + 2)] += by;
        }
        return true;
    }

    AlongRain matrix_;
    double mu_;
    std::array<Couplings, 2> couplings_;  // of even and odd columns
    ColumnPlane<Real> seen_, pull_, alpha_;
    LineBlock<Real> block_;
    std::vector<Real> waiting_;  // how far column x - 1 lies behind its neighbours, about
};

/// Hands out what threads work in, so that there is one of it a thread and not one a frame.
template <class Room>
class Rooms {
public:
    template <class Make>
    std::unique_ptr<Room> take(Make&& make)
    {
        {
            const std::lock_guard lock(mutex_);
            if (!free_.empty()) {
                std::unique_ptr<Room> room = std::move(free_.back());
                free_.pop_back();
                return room;
            }
        }
        return make();
    }
    void give(std::unique_ptr<Room> room)
    {
        const std::lock_guard lock(mutex_);
        free_.push_back(std::move(room));
    }

private:
    std::mutex mutex_;
    std::vector<std::unique_ptr<Room>> free_;
};

template <class Real>
void solveBounded(const Footage& footage, const ImageF& scene, const RainTerms& terms, std::span<ImageF> alphas,
                  double tolerance)
{
    const std::vector<float> ones(std::size_t(scene.width()), 1.0f);
    Rooms<BoundedAlpha<Real>> rooms;
    parallelFor(0, std::ptrdiff_t(alphas.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        auto room =
            rooms.take([&] { return std::make_unique<BoundedAlpha<Real>>(scene.width(), scene.height(), terms); });
        for (auto k = std::size_t(first); k < std::size_t(last); ++k)
            room->solve(FrameData(footage, k, scene, terms, ones), alphas[k], tolerance);
        rooms.give(std::move(room));
    });
}

}  // namespace

void solveAlpha(const Footage& footage, const ImageF& scene, const RainTerms& terms, std::span<ImageF> alphas,
                double tolerance)
{
    assert(footage.frames.size() == alphas.size());
    if (terms.bounded) {
        if (tolerance >= floatTolerance)
            solveBounded<float>(footage, scene, terms, alphas, tolerance);
        else
            solveBounded<double>(footage, scene, terms, alphas, tolerance);
        return;
    }
    const std::vector<float> ones(std::size_t(scene.width()), 1.0f);
    parallelFor(0, std::ptrdiff_t(alphas.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (auto k = std::size_t(first); k < std::size_t(last); ++k)
            FreeAlpha(FrameData(footage, k, scene, terms, ones), scene.width(), scene.height(), terms)
                .solve(alphas[k], tolerance);
    });
}

}  // namespace virga::matte
