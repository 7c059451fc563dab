#include "matte/StrokeMeasure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/Simd.h"

namespace virga::matte {
namespace {

constexpr double kHigh = 5.0;   // [sigma]
constexpr int kBeside = 8;      // [px] across, each side: what a stroke is compared with
constexpr double kStep = 0.25;  // [px] across, of the grid that strokes are measured on
constexpr int kPad = 8;         // [px] along, how far that grid goes beyond the ends

VIRGA_SIMD void addRow(const float* __restrict row, int count, double* __restrict to)
{
    for (int i = 0; i < count; ++i) to[i] += double(row[i]);
}

// The sum of what lies above `level`.
VIRGA_SIMD float sumAbove(const float* row, int count, float level)
{
    using P = PackOf<float>;
    const P::Type zero = {};
    P::Type sums = {};
    int i = 0;
    for (; i + P::lanes <= count; i += P::lanes) {
        const P::Type over = P::at(row + i) - level;
        sums += over > zero ? over : zero;
    }
    float sum = 0;
    for (; i < count; ++i) sum += std::max(row[i] - level, 0.0f);
    for (int l = 0; l < P::lanes; ++l) sum += sums[l];
    return sum;
}

struct Line {
    double u, v, slope, rms;  // through (u, v) [px of Frame]
};
Line lineThrough(const Ridge& ridge, const StrokeRidges& up)
{
    double w = 0, mu = 0, mv = 0, uv = 0, vv = 0, square = 0;
    for (const RidgeRow& s : ridge) w += s.height, mu += s.height * s.u, mv += s.height * s.row;
    mu /= w, mv /= w;
    for (const RidgeRow& s : ridge) {
        uv += s.height * (s.u - mu) * (s.row - mv);
        vv += s.height * (s.row - mv) * (s.row - mv);
    }
    const double slope = vv > 0 ? uv / vv : 0;
    for (const RidgeRow& s : ridge) square += s.height * std::pow(s.u - mu - slope * (s.row - mv), 2);
    return {mu + up.u0, mv + up.v0, slope, std::sqrt(square / w)};
}

// Where a ridge is two strokes end to end: the first index of the second, or -1. `along`: brightness, from `first` to
// `last` (ends excluded), `across`: width.
int partingOf(const std::vector<double>& along, const std::vector<double>& across, int first, int last, int least,
              double noise)
{
    if (last - first < 2 * least + 1) return -1;
    std::vector<double> before, after;
    const auto median = [](const std::vector<double>& from, int a, int b, std::vector<double>& work) {
        work.assign(from.begin() + a, from.begin() + b);
        return upperMedian(work);
    };
    const double most = *std::max_element(along.begin() + first, along.begin() + last);
    for (int k = first + least; k < last - least; ++k) {
        if (along[std::size_t(k)] >= 0.35 * most) continue;  // as no median is more
        if (along[std::size_t(k)] > along[std::size_t(k - 1)] || along[std::size_t(k)] > along[std::size_t(k + 1)])
            continue;
        const double lesser = std::min(median(along, first, k, before), median(along, k + 1, last, after));
        if (along[std::size_t(k)] < 0.35 * lesser && lesser - along[std::size_t(k)] > 2 * noise) return k;
    }
    // A jump: two constants explain the logarithm four times as well as one.
    for (const std::vector<double>* values : {&along, &across}) {
        // The ends fall off, by half and more in 3 px, and are no jump.
        int inner0 = first, inner1 = last;
        while (inner0 + 3 < last && along[std::size_t(inner0)] < 0.6 * along[std::size_t(inner0 + 3)]) ++inner0;
        while (inner1 - 4 >= first && along[std::size_t(inner1 - 1)] < 0.6 * along[std::size_t(inner1 - 4)]) --inner1;
        inner0 += 1, inner1 -= 1;
        if (inner1 - inner0 < 2 * least) continue;
        std::vector<double> sum(1, 0.0), squares(1, 0.0);
        for (int k = inner0; k < inner1; ++k) {
            const double log = std::log(std::max((*values)[std::size_t(k)], 1e-3));
            sum.push_back(sum.back() + log), squares.push_back(squares.back() + log * log);
        }
        const auto error = [&](int a, int b) {
            const double s = sum[std::size_t(b)] - sum[std::size_t(a)];
            return squares[std::size_t(b)] - squares[std::size_t(a)] - s * s / (b - a);
        };
        const int n = int(sum.size()) - 1;
        double best = 0.25 * error(0, n);
        int place = -1;
        for (int k = least; k <= n - least; ++k)
            if (const double e = error(0, k) + error(k, n); e < best) {
                const double step = (sum[std::size_t(n)] - sum[std::size_t(k)]) / (n - k) - sum[std::size_t(k)] / k;
                if (std::abs(step) > std::log(1.6)) best = e, place = inner0 + k;
            }
        if (place >= 0) return place;
    }
    return -1;
}

// The distance from `from` at which the profile first falls under `level` in direction `step`, by linear interpolation;
// at most `limit` samples.
double crossing(const std::vector<double>& profile, int from, int step, double level, int limit)
{
    for (int k = 0; k < limit; ++k) {
        const int i = from + k * step, next = i + step;
        if (next < 0 || next >= int(profile.size())) return k;
        const double a = profile[std::size_t(i)], b = profile[std::size_t(next)];
        if (b < level) return a > level ? k + (a - level) / (a - b) : k;
    }
    return limit;
}

void measure(const ImageF& alpha, const StrokeRidges& up, const Ridge& ridge, const RainStrokeOptions& options,
             int depth, std::vector<RainStroke>& out)
{
    const double sigma = up.sigma;
    int strong = 0;
    const double high = std::max(kHigh * sigma, options.minContrast);
    for (const RidgeRow& s : ridge) strong += s.height > high;
    if (strong * 2 < options.minLength || ridge.size() < 3) return;

    const Line line = lineThrough(ridge, up);
    const double turn = std::atan(line.slope), slant = options.slant + turn;
    const StrokeFrame own{up.frame.x(line.u, line.v), up.frame.y(line.u, line.v), std::sin(slant), std::cos(slant)};

    // A grid along the stroke's own line: rows of 1 px along, kStep across.
    const double from = (ridge.front().row + up.v0 - line.v) / std::cos(turn);
    const double to = (ridge.back().row + up.v0 - line.v) / std::cos(turn);
    const int rows = int(std::ceil(to - from)) + 1 + 2 * kPad, first = kPad, last = rows - kPad;
    const int half = int((options.maxWidth / 2 + 2) / kStep), columns = 2 * half + 1;
    const double top = from - kPad;
    ImageF grid(columns, rows, 1);
    for (int j = 0; j < rows; ++j)
        sampleLine(alpha, own.x(-half * kStep, top + j), own.y(-half * kStep, top + j), own.c * kStep, -own.s * kStep,
                   columns, grid.row(j));

    RainStroke stroke;
    std::vector<double> profile(std::size_t(columns), 0.0), work;
    for (int j = first; j < last; ++j) addRow(grid.row(j), columns, profile.data());
    for (double& value : profile) value /= last - first;
    std::array<float, kBeside> beside;
    for (int j = first; j < last; ++j)
        for (const double t : {options.maxWidth / 2 + 2.5, -options.maxWidth / 2 - 1.5 - kBeside}) {
            sampleLine(alpha, own.x(t, top + j), own.y(t, top + j), own.c, -own.s, kBeside, beside.data());
            work.insert(work.end(), beside.begin(), beside.end());
        }
    stroke.background = upperMedian(work);
    for (double& value : profile) value -= stroke.background;

    int middle = half;
    for (int i = half - int(1.5 / kStep); i <= half + int(1.5 / kStep); ++i)
        if (profile[std::size_t(i)] > profile[std::size_t(middle)]) middle = i;
    const double height = profile[std::size_t(middle)];
    if (!(height > 0)) return;

    // How far the stroke reaches: to the valley, where the profile rises again, or to nothing.
    const int farthest = int((options.maxWidth / 2 + 2) / kStep);
    const auto reach = [&](int step) {
        double lowest = height;
        int place = 0;
        for (int k = 1; k <= farthest && middle + k * step >= 0 && middle + k * step < columns; ++k) {
            const double value = profile[std::size_t(middle + k * step)];
            if (value < lowest) lowest = value, place = k;
            if (value > lowest + 0.15 * height) return place;
        }
        return farthest;
    };
    const int left = reach(-1), right = reach(1);
    const double leftHalf = crossing(profile, middle, -1, height / 2, left);
    const double rightHalf = crossing(profile, middle, 1, height / 2, right);
    stroke.width = (leftHalf + rightHalf) * kStep;
    if (!(stroke.width > 0) || stroke.width > options.maxWidth) return;
    const double across = (middle - half + (rightHalf - leftHalf) / 2) * kStep;  // of the true middle
    double mass = 0, moment = 0, square = 0, steepest = 0;
    const int momentReach = int(std::ceil(1.5 * std::max(leftHalf, rightHalf) + 1 / kStep));
    for (int i = std::max(middle - std::min(left, momentReach), 1); i <= middle + std::min(right, momentReach); ++i) {
        if (i >= columns) break;
        const double value = std::max(profile[std::size_t(i)], 0.0), t = (i - half) * kStep;
        mass += value, moment += value * t, square += value * t * t;
        steepest = std::max(steepest, std::abs(profile[std::size_t(i)] - profile[std::size_t(i - 1)]));
    }
    stroke.widthMoment = std::sqrt(12 * std::max(square / mass - moment * moment / (mass * mass), 0.0));
    stroke.sharpness = std::min(steepest / kStep / height, 1.0);
    stroke.reachLeft = left * kStep + (across - (middle - half) * kStep);
    stroke.reachRight = right * kStep - (across - (middle - half) * kStep);

    // Along: the mean over the middle half of the width, and the width of each row (area / height).
    std::vector<double> raw(std::size_t(rows), 0.0), along(raw), widths(raw);
    const int side = std::max(1, int(std::lround(stroke.width / 4 / kStep)));
    const int centre = std::clamp(half + int(std::lround(across / kStep)), side, columns - 1 - side);
    const int leftmost = std::max(middle - left, 0), rightmost = std::min(middle + right, columns - 1);
    for (int j = 0; j < rows; ++j) {
        for (int i = centre - side; i <= centre + side; ++i)
            raw[std::size_t(j)] += (grid.at(i, j) - stroke.background) / (2 * side + 1);
        const double area =
            sumAbove(grid.row(j) + leftmost, rightmost - leftmost + 1, float(stroke.background)) * kStep;
        widths[std::size_t(j)] = area / std::max(raw[std::size_t(j)], 0.1 * height);
    }
    for (int j = 0; j < rows; ++j)
        along[std::size_t(j)] = (raw[std::size_t(std::max(j - 1, 0))] + 2 * raw[std::size_t(j)] +
                                 raw[std::size_t(std::min(j + 1, rows - 1))]) /
                                4;

    const int least = std::max(2, int(options.minLength * 0.75));
    if (depth < 8)
        if (const int parting = partingOf(along, widths, first, last, least, options.noise); parting >= 0) {
            Ridge before, after;
            for (const RidgeRow& s : ridge)
                ((s.row + up.v0 - line.v) / std::cos(turn) < top + parting ? before : after).push_back(s);
            if (!before.empty() && !after.empty()) {
                measure(alpha, up, before, options, depth + 1, out);
                measure(alpha, up, after, options, depth + 1, out);
                return;
            }
        }

    work.assign(along.begin() + first, along.begin() + last);
    stroke.contrast = upperMedian(work);
    if (!(stroke.contrast > high)) return;
    const double level = stroke.contrast / 2;
    // From the outermost bright row, outwards: a dark bead in the middle does not end a stroke.
    int head = first, tail = last - 1;
    while (head < tail && along[std::size_t(head)] < level) ++head;
    while (tail > head && along[std::size_t(tail)] < level) --tail;
    const double begin = top + head - crossing(along, head, -1, level, head);
    const double end = top + tail + crossing(along, tail, 1, level, rows - 1 - tail);
    stroke.length = end - begin;
    if (stroke.length < options.minLength || stroke.length < options.minElongation * stroke.width) return;

    double sum = 0;
    int counted = 0;
    for (int j = 0; j < rows; ++j)
        if (top + j >= begin && top + j <= end) {
            sum += raw[std::size_t(j)], ++counted;
            stroke.peak = std::max(stroke.peak, along[std::size_t(j)]);
        }
    stroke.mean = counted > 0 ? sum / counted : stroke.contrast;
    // Each row explained by its multiple of the mean profile.
    const double margin = std::max(stroke.width, 2.0) / 2;
    double energy = 0, explained = 0, norm = 0;
    for (int i = leftmost; i <= rightmost; ++i) norm += profile[std::size_t(i)] * profile[std::size_t(i)];
    for (int j = 0; j < rows; ++j) {
        if (top + j < begin - margin || top + j > end + margin) continue;
        double projection = 0;
        for (int i = leftmost; i <= rightmost; ++i) {
            const double value = grid.at(i, j) - stroke.background;
            projection += value * profile[std::size_t(i)], energy += value * value;
        }
        explained += projection * projection / norm;
    }
    stroke.plainness = energy > 0 ? std::min(explained / energy, 1.0) : 0.0;
    stroke.slant = std::remainder(slant, std::numbers::pi);
    stroke.x = own.x(across, (begin + end) / 2);
    stroke.y = own.y(across, (begin + end) / 2);
    stroke.straightness = 1 / (1 + std::pow(line.rms / (stroke.width / 4), 2));

    // Around it, in the filtered picture, where noise is low: both sides, and before and after its ends.
    work.clear();
    const StrokeFrame& frameUp = up.frame;
    const auto around = [&](double t, double w) {
        const double x = own.x(across + t, w) - frameUp.cx, y = own.y(across + t, w) - frameUp.cy;
        const int i = int(std::lround(x * frameUp.c - y * frameUp.s - up.u0));
        const int j = int(std::lround(x * frameUp.s + y * frameUp.c - up.v0));
        if (i >= 0 && j >= 0 && i < up.filtered.width() && j < up.filtered.height())
            work.push_back(up.filtered.at(i, j) - stroke.background);
    };
    for (double w = begin - 4; w <= end + 4; w += 1)
        for (double t = stroke.width + 1; t <= stroke.width + 5; t += 1) around(t, w), around(-t, w);
    for (double t = -stroke.width; t <= stroke.width; t += 1)
        for (double w = 4; w <= 8; w += 1) around(t, begin - strokeBlur - w), around(t, end + strokeBlur + w);
    if (!work.empty()) {
        const auto decile = work.begin() + std::ptrdiff_t(work.size() * 9 / 10);
        std::nth_element(work.begin(), decile, work.end());
        stroke.isolation = std::clamp(1 - std::max(*decile - sigma, 0.0) / stroke.contrast, 0.0, 1.0);
    }

    stroke.inside = true;
    for (const double w : {begin - 1, end + 1})
        for (const double t : {-stroke.width / 2 - 0.5, stroke.width / 2 + 0.5})
            stroke.inside = stroke.inside && isWithin(alpha, own.x(across + t, w), own.y(across + t, w));
    if (stroke.inside)
        stroke.score = stroke.straightness * stroke.isolation * stroke.plainness * stroke.plainness *
                       std::sqrt(stroke.sharpness) * std::min(1.0, stroke.length / (4 * stroke.width)) *
                       std::min(1.0, 1.5 * stroke.contrast / stroke.peak) * stroke.contrast /
                       (stroke.contrast + 4 * sigma);
    out.push_back(stroke);
}

}  // namespace

std::vector<RainStroke> measureRidge(const ImageF& alpha, const StrokeRidges& up, const Ridge& ridge,
                                     const RainStrokeOptions& options)
{
    std::vector<RainStroke> strokes;
    measure(alpha, up, ridge, options, 0, strokes);
    return strokes;
}

}  // namespace virga::matte
