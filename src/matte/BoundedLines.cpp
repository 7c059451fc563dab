#include "matte/BoundedLines.h"

#include <algorithm>
#include <cstdint>

namespace virga::matte {
namespace {

constexpr int lanes = LineBlock::lanes;
constexpr int mostSetChanges = 40;
constexpr int sweepsInstead = 200;

enum Held : std::int8_t { Free = 0, AtLow = -1, AtHigh = 1 };
using HeldRow = std::array<std::int8_t, lanes>;

/// What becomes of an entry: a free one that left the bounds is held there, a held one that the sum pulls inwards is
/// freed.
std::int8_t nextState(std::int8_t state, double x, double slope, double low, double high)
{
    if (state == AtLow) return slope < 0.0 ? Free : AtLow;
    if (state == AtHigh) return slope > 0.0 ? Free : AtHigh;
    if (x < low) return AtLow;
    return x > high ? AtHigh : Free;
}

}  // namespace

void LineBlock::resize(int length)
{
    for (auto* rows : {&diagonal, &link, &rightSide, &value, &factor_, &reduced_, &trial_})
        rows->resize(std::size_t(length));
}

void solveLines(LineBlock& block)
{
    const int n = block.length();
    for (int i = 0; i < n; ++i) {
        for (int l = 0; l < lanes; ++l) {
            double pivot = block.diagonal[i][l], right = block.rightSide[i][l];
            if (i > 0) {
                const double before = block.link[i - 1][l];
                pivot -= before * block.factor_[i - 1][l];
                right -= before * block.reduced_[i - 1][l];
            }
            block.factor_[i][l] = i + 1 < n ? block.link[i][l] / pivot : 0.0;
            block.reduced_[i][l] = right / pivot;
        }
    }
    for (int i = n - 1; i >= 0; --i)
        for (int l = 0; l < lanes; ++l)
            block.value[i][l] = block.reduced_[i][l] - (i + 1 < n ? block.factor_[i][l] * block.value[i + 1][l] : 0.0);
}

namespace {

/// One sweep of projected Gauss-Seidel over the block's values.
void sweep(LineBlock& block, double low, double high)
{
    const int n = block.length();
    for (int i = 0; i < n; ++i)
        for (int l = 0; l < lanes; ++l) {
            double right = block.rightSide[i][l];
            if (i > 0) right -= block.link[i - 1][l] * block.value[i - 1][l];
            if (i + 1 < n) right -= block.link[i][l] * block.value[i + 1][l];
            block.value[i][l] = std::clamp(right / block.diagonal[i][l], low, high);
        }
}

}  // namespace

void solveLines(LineBlock& block, double low, double high)
{
    const int n = block.length();
    std::vector<HeldRow> held(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i)
        for (int l = 0; l < lanes; ++l) {
            const double x = block.value[i][l];
            held[i][l] = x <= low ? AtLow : x >= high ? AtHigh : Free;
        }

    auto& trial = block.trial_;
    for (int change = 0; change < mostSetChanges; ++change) {
        // Elimination over the free entries; a held one is a known number to its neighbours.
        for (int i = 0; i < n; ++i) {
            for (int l = 0; l < lanes; ++l) {
                const double before = i > 0 ? block.link[i - 1][l] : 0.0;
                const double after = i + 1 < n ? block.link[i][l] : 0.0;
                const double pivot = block.diagonal[i][l] - before * (i > 0 ? block.factor_[i - 1][l] : 0.0);
                const double right = block.rightSide[i][l] - before * (i > 0 ? block.reduced_[i - 1][l] : 0.0);
                const std::int8_t state = held[i][l];
                block.factor_[i][l] = state == Free ? after / pivot : 0.0;
                block.reduced_[i][l] = state == Free ? right / pivot : state == AtLow ? low : high;
            }
        }
        for (int i = n - 1; i >= 0; --i)
            for (int l = 0; l < lanes; ++l)
                trial[i][l] = block.reduced_[i][l] - (i + 1 < n ? block.factor_[i][l] * trial[i + 1][l] : 0.0);

        bool changed = false;
        for (int i = 0; i < n; ++i) {
            for (int l = 0; l < lanes; ++l) {
                const double x = trial[i][l];
                double slope = block.diagonal[i][l] * x - block.rightSide[i][l];
                if (i > 0) slope += block.link[i - 1][l] * trial[i - 1][l];
                if (i + 1 < n) slope += block.link[i][l] * trial[i + 1][l];
                const std::int8_t was = held[i][l];
                const std::int8_t now = nextState(was, x, slope, low, high);
                changed |= now != was;
                held[i][l] = now;
            }
        }
        if (!changed) {
            block.value.swap(trial);
            return;
        }
    }
    for (int pass = 0; pass < sweepsInstead; ++pass) sweep(block, low, high);
}

}  // namespace virga::matte
