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
#include "matte/RainEquation.h"

namespace virga::matte {
namespace {

/// Keeps the solve bounded where neither the data nor the cost sees alpha. Far below a bit of 16 in (C - S)^2.
constexpr double ridge = 1e-12;

constexpr int mostSteps = 500;

/// From here on a tolerance is one that float meets.
constexpr double floatTolerance = 1e-5;

// ---------------------------------------------------------------------------------------------------------------------
// The matrix of sum (sin dx + cos dy)^2, entry by entry. A column goes along the rain as far as the grid allows: down
// the picture, or, beyond 45 degrees, across it; the formulas are the same with the axes swapped.

struct AlongRain {
    int columns, rows;
    bool isLevel;                    // columns go across the picture
    std::ptrdiff_t toColumn, toRow;  // steps in a picture of one channel
    double s, c;                     // of D0: across the columns, down them; |s| <= |c|

    AlongRain(int width, int height, double slant)
        : columns(width), rows(height), isLevel(false), toColumn(1), toRow(width), s(std::sin(slant)),
          c(std::cos(slant))
    {
        if (std::abs(s) > std::abs(c)) {
            isLevel = true;
            std::swap(columns, rows);
            std::swap(toColumn, toRow);
            std::swap(s, c);
        }
    }

    std::ptrdiff_t at(int x, int y) const { return x * toColumn + y * toRow; }

    /// Of the squares of differences down column x, >= 0; and of the square of the value at (x, y) itself.
    double coupling(int x) const { return c * (across(x) + c); }
    double own(int x, int y) const
    {
        return across(x) * across(x) + (x > 0 ? s * s : 0.0) + across(x) * c * (double(y + 1 < rows) - double(y > 0));
    }
    /// Between (x, y) and (x + 1, y), which is inside.
    double right(int y) const { return -s * (s + (y + 1 < rows ? c : 0.0)); }
    /// Between (x + 1, y) and (x, y + 1).
    double cross() const { return s * c; }

    double product(const double* v, int x, int y) const
    {
        const double* here = v + at(x, y);
        double sum = own(x, y) * here[0];
        if (y + 1 < rows) sum += coupling(x) * (here[0] - here[toRow]);
        if (y > 0) sum += coupling(x) * (here[0] - here[-toRow]);
        if (x + 1 < columns) {
            sum += right(y) * here[toColumn];
            if (y > 0) sum += cross() * here[toColumn - toRow];
        }
        if (x > 0) {
            sum += right(y) * here[-toColumn];
            if (y + 1 < rows) sum += cross() * here[toRow - toColumn];
        }
        return sum;
    }

private:
    double across(int x) const { return x + 1 < columns ? s : 0.0; }
};

// ---------------------------------------------------------------------------------------------------------------------
// What the data say, row by row.

/// A row of a frame and what goes with it.
struct DataRow {
    int width, channels;
    const float *frame, *scene, *trust, *cost;
    std::array<float, 3> color;
    double eta;
};

/// seen: w sum over channels of (C - S)^2, what multiplies alpha^2; pull: w sum of (C - S) (I - S), less the cost.
template <class Real, int channels>
VIRGA_INLINE void askChannels(const DataRow& row, Real* __restrict seen, Real* __restrict pull)
{
    const float *frame = row.frame, *scene = row.scene, *trust = row.trust, *cost = row.cost;
    const Real eta = Real(row.eta);
    const Real color[3] = {row.color[0], row.color[1], row.color[2]};
    for (int x = 0; x < row.width; ++x) {
        Real square = 0, product = 0;
        for (int j = 0; j < channels; ++j) {
            const Real s = scene[x * channels + j], gap = color[j] - s;
            square += gap * gap;
            product += gap * (frame[x * channels + j] - s);
        }
        seen[x] = trust[x] * square;
        pull[x] = trust[x] * product - eta * cost[x];
    }
}

template <class Real>
VIRGA_INLINE void askAny(const DataRow& row, Real* seen, Real* pull)
{
    if (row.channels == 3)
        askChannels<Real, 3>(row, seen, pull);
    else
        askChannels<Real, 1>(row, seen, pull);
}

VIRGA_SIMD void askRow(const DataRow& row, float* seen, float* pull) { askAny(row, seen, pull); }
VIRGA_SIMD void askRow(const DataRow& row, double* seen, double* pull) { askAny(row, seen, pull); }

/// The rows of frame k against a scene. `ones` stands for a trust or a cost that is not given.
class FrameData {
public:
    FrameData(const Footage& footage, std::size_t k, const ImageF& scene, const RainTerms& terms,
              const std::vector<float>& ones)
        : footage_(footage), k_(k), scene_(scene), terms_(terms), ones_(ones)
    {
        assert(scene.channels() == 1 || scene.channels() == 3);
    }

    template <class Real>
    void ask(int y, Real* seen, Real* pull) const
    {
        const DataRow row{scene_.width(),
                          scene_.channels(),
                          footage_.frames[k_].row(y),
                          scene_.row(y),
                          footage_.trust.empty() ? ones_.data() : footage_.trust[k_].row(y),
                          footage_.cost.empty() ? ones_.data() : footage_.cost[k_].row(y),
                          terms_.color,
                          terms_.eta};
        askRow(row, seen, pull);
    }

private:
    const Footage& footage_;
    std::size_t k_;
    const ImageF& scene_;
    const RainTerms& terms_;
    const std::vector<float>& ones_;
};

// ---------------------------------------------------------------------------------------------------------------------
// Without bounds.

class FreeAlpha {
public:
    FreeAlpha(const FrameData& data, int width, int height, const RainTerms& terms)
        : matrix_(width, height, terms.slant), mu_(terms.mu), seen_(std::size_t(width) * std::size_t(height)),
          right_(seen_.size())
    {
        for (int y = 0; y < height; ++y)
            data.ask(y, seen_.data() + std::ptrdiff_t(y) * width, right_.data() + std::ptrdiff_t(y) * width);
    }

    /// Conjugate gradients, with the columns alone as preconditioner.
    void solve(ImageF& alpha, double tolerance)
    {
        const std::size_t n = right_.size();
        std::vector<double> x(alpha.data(), alpha.data() + n), residual(n), z(n), direction(n), image(n);
        multiply(x, image);
        double scale = 0.0;
        for (std::size_t i = 0; i < n; ++i) {
            residual[i] = right_[i] - image[i];
            scale += right_[i] * right_[i];
        }
        columns(residual, z);
        direction = z;
        double rz = dot(residual, z);
        for (int step = 0; step < mostSteps && dot(residual, residual) > tolerance * tolerance * scale; ++step) {
            multiply(direction, image);
            const double curvature = dot(direction, image);
            if (!(curvature > 0.0)) break;
            const double length = rz / curvature;
            for (std::size_t i = 0; i < n; ++i) {
                x[i] += length * direction[i];
                residual[i] -= length * image[i];
            }
            columns(residual, z);
            const double next = dot(residual, z);
            for (std::size_t i = 0; i < n; ++i) direction[i] = z[i] + next / rz * direction[i];
            rz = next;
        }
        for (std::size_t i = 0; i < n; ++i) alpha.data()[i] = float(x[i]);
    }

private:
    using Block = LineBlock<double>;

    static double dot(const std::vector<double>& a, const std::vector<double>& b)
    {
        double sum = 0.0;
        for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
        return sum;
    }

    void multiply(const std::vector<double>& v, std::vector<double>& to) const
    {
        for (int y = 0; y < matrix_.rows; ++y)
            for (int x = 0; x < matrix_.columns; ++x) {
                const auto i = std::size_t(matrix_.at(x, y));
                to[i] = (seen_[i] + ridge) * v[i] + mu_ * matrix_.product(v.data(), x, y);
            }
    }

    void columns(const std::vector<double>& from, std::vector<double>& to) const
    {
        Block block(matrix_.rows);
        for (int first = 0; first < matrix_.columns; first += Block::lanes) {
            const int lanes = std::min(Block::lanes, matrix_.columns - first);
            block.coupling.fill(0.0);
            for (int l = 0; l < lanes; ++l) block.coupling[l] = mu_ * matrix_.coupling(first + l);
            for (int y = 0; y < matrix_.rows; ++y) {
                block.own[y].fill(1.0);
                block.pull[y].fill(0.0);
                for (int l = 0; l < lanes; ++l) {
                    const auto i = std::size_t(matrix_.at(first + l, y));
                    block.own[y][l] = seen_[i] + ridge + mu_ * matrix_.own(first + l, y);
                    block.pull[y][l] = from[i];
                }
            }
            solveLines(block);
            for (int y = 0; y < matrix_.rows; ++y)
                for (int l = 0; l < lanes; ++l) to[std::size_t(matrix_.at(first + l, y))] = block.value[y][l];
        }
    }

    AlongRain matrix_;
    double mu_;
    std::vector<double> seen_, right_;
};

// ---------------------------------------------------------------------------------------------------------------------
// With bounds. The columns of a picture as the solver reads them: the even ones of a row side by side, then the odd
// ones, so that a block is contiguous and so are the columns beside it.

template <class Real>
VIRGA_INLINE void splitAny(const Real* __restrict row, int width, Real* __restrict even, Real* __restrict odd)
{
    for (int j = 0; j < width / 2; ++j) {
        even[j] = row[2 * j];
        odd[j] = row[2 * j + 1];
    }
    if (width % 2) even[width / 2] = row[width - 1];
}
VIRGA_SIMD void split(const float* row, int width, float* even, float* odd) { splitAny(row, width, even, odd); }
VIRGA_SIMD void split(const double* row, int width, double* even, double* odd) { splitAny(row, width, even, odd); }

template <class Real>
VIRGA_INLINE void mergeAny(const Real* __restrict even, const Real* __restrict odd, int width, float* __restrict row)
{
    for (int j = 0; j < width / 2; ++j) {
        row[2 * j] = float(even[j]);
        row[2 * j + 1] = float(odd[j]);
    }
    if (width % 2) row[width - 1] = float(even[width / 2]);
}
VIRGA_SIMD void merge(const float* even, const float* odd, int width, float* row) { mergeAny(even, odd, width, row); }
VIRGA_SIMD void merge(const double* even, const double* odd, int width, float* row) { mergeAny(even, odd, width, row); }

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

/// Eight rows of eight become columns.
VIRGA_INLINE void turnTile(const float* from, std::ptrdiff_t fromStep, float* to, std::ptrdiff_t toStep)
{
    using P = PackOf<float>;
    P::Type a[8], b[8];
    for (int k = 0; k < 8; k += 2) {
        const P::Type even = P::at(from + k * fromStep), odd = P::at(from + (k + 1) * fromStep);
        a[k] = __builtin_shufflevector(even, odd, 0, 8, 1, 9, 4, 12, 5, 13);
        a[k + 1] = __builtin_shufflevector(even, odd, 2, 10, 3, 11, 6, 14, 7, 15);
    }
    for (int k = 0; k < 8; k += 4)
        for (int h = 0; h < 2; ++h) {
            b[k + 2 * h] = __builtin_shufflevector(a[k + h], a[k + h + 2], 0, 1, 8, 9, 4, 5, 12, 13);
            b[k + 2 * h + 1] = __builtin_shufflevector(a[k + h], a[k + h + 2], 2, 3, 10, 11, 6, 7, 14, 15);
        }
    for (int k = 0; k < 4; ++k) {
        P::at(to + k * toStep) = __builtin_shufflevector(b[k], b[k + 4], 0, 1, 2, 3, 8, 9, 10, 11);
        P::at(to + (k + 4) * toStep) = __builtin_shufflevector(b[k], b[k + 4], 4, 5, 6, 7, 12, 13, 14, 15);
    }
}
/// So many tiles, the next one `fromNext` and `toNext` on.
VIRGA_SIMD void turnTiles(const float* from, std::ptrdiff_t fromStep, std::ptrdiff_t fromNext, float* to,
                          std::ptrdiff_t toStep, std::ptrdiff_t toNext, int tiles)
{
    for (int n = 0; n < tiles; ++n) turnTile(from + n * fromNext, fromStep, to + n * toNext, toStep);
}

template <class Real>
class ColumnPlane {
public:
    static constexpr int lanes = LineBlock<Real>::lanes;

    ColumnPlane(const AlongRain& matrix)
        : isLevel_(matrix.isLevel), columns_(matrix.columns), rows_(matrix.rows),
          blocks_(((matrix.columns + 1) / 2 + lanes - 1) / lanes), stride_((2 * blocks_ + 3) * lanes),
          values_(std::size_t(stride_) * std::size_t(rows_ + 2), Real(0))
    {
    }

    /// Blocks of the columns of one parity.
    int blocks() const { return blocks_; }
    std::ptrdiff_t stride() const { return stride_; }
    /// Row y of the columns of a parity; beside and above what is inside there are zeros.
    Real* row(int y, int parity) { return values_.data() + (y + 1) * stride_ + lanes + parity * (blocks_ + 1) * lanes; }
    const Real* row(int y, int parity) const { return const_cast<ColumnPlane*>(this)->row(y, parity); }

    /// So many rows of the picture go in and out together: where lines are level they lie across the plane, and one at
    /// a time would touch a line of the cache for each value.
    static constexpr int rowsTogether = 16;

    /// Rows y to y + count of the picture, one after another, from and to; y a multiple of rowsTogether.
    void put(int y, int count, const Real* values)
    {
        if (!isLevel_) {
            for (int t = 0; t < count; ++t) split(values + t * columns_, columns_, row(y + t, 0), row(y + t, 1));
            return;
        }
        int x = 0;
        if constexpr (std::is_same_v<Real, float>)
            if (count == rowsTogether) {
                for (int parity = 0; parity < 2; ++parity)
                    turnTiles(values + parity * rows_, 2 * rows_, 8, row(0, parity) + y / 2, stride_, 8 * stride_,
                              rows_ / 8);
                x = rows_ / 8 * 8;
            }
        for (; x < rows_; ++x)
            for (int t = 0; t < count; ++t) row(x, t % 2)[(y + t) / 2] = values[t * rows_ + x];
    }
    void get(int y, int count, float* values) const
    {
        if (!isLevel_) {
            for (int t = 0; t < count; ++t) merge(row(y + t, 0), row(y + t, 1), columns_, values + t * columns_);
            return;
        }
        int x = 0;
        if constexpr (std::is_same_v<Real, float>)
            if (count == rowsTogether) {
                for (int parity = 0; parity < 2; ++parity)
                    turnTiles(row(0, parity) + y / 2, stride_, 8 * stride_, values + parity * rows_, 2 * rows_, 8,
                              rows_ / 8);
                x = rows_ / 8 * 8;
            }
        for (; x < rows_; ++x)
            for (int t = 0; t < count; ++t) values[t * rows_ + x] = float(row(x, t % 2)[(y + t) / 2]);
    }

private:
    bool isLevel_;
    int columns_, rows_, blocks_;
    std::ptrdiff_t stride_;
    std::vector<Real> values_;
};

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
                const auto own = [&](int y) { return Real(ridge + mu_ * matrix_.own(x, y)); };
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
        for (int step = 0; step < mostSteps && !isSettled; ++step) {
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
