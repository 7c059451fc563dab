#include "matte/AlphaProblem.h"

#include "core/Simd.h"

namespace virga::matte {
namespace {

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

}  // namespace

VIRGA_SIMD void askRow(const DataRow& row, float* seen, float* pull) { askAny(row, seen, pull); }
VIRGA_SIMD void askRow(const DataRow& row, double* seen, double* pull) { askAny(row, seen, pull); }

}  // namespace virga::matte
