#include "matte/RainStrokes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include "core/Error.h"
#include "core/Parallel.h"

namespace virga::matte {
namespace {

constexpr double kBlur = 2.0;        // [px] along
constexpr int kBlurReach = 6;        // [px], 3 sigma
constexpr double kBlurGain = 0.376;  // standard deviation of white noise after it: (2 sqrt(pi) kBlur)^-1/2
constexpr int kOpening = 2;          // half length of the opening along [px]
constexpr double kLow = 2.5, kHigh = 5.0;
constexpr int kBeside = 8;      // [px] across, each side: what a pixel is compared with
constexpr double kLink = 1.5;   // [px] across from one row to the next: ridges of 45 degrees off are none
constexpr double kStep = 0.25;  // [px] across, of the grid that strokes are measured on
constexpr int kPad = 8;         // [px] along, how far that grid goes beyond the ends

// The value at a point, linear between pixels, with bounds that repeat.
double linear(const ImageF& image, double x, double y)
{
    x = std::clamp(x, 0.0, image.width() - 1.0), y = std::clamp(y, 0.0, image.height() - 1.0);
    const int i = int(x), j = int(y), right = i + 1 < image.width() ? 1 : 0;
    const float *row = image.row(j) + i, *below = j + 1 < image.height() ? image.row(j + 1) + i : row;
    const double f = x - i, g = y - j;
    return (1 - g) * ((1 - f) * row[0] + f * row[right]) + g * ((1 - f) * below[0] + f * below[right]);
}

// The turned picture: u across, v along the rain, [px] from the middle of the alpha's.
struct Frame {
    double cx, cy, s, c;
    double x(double u, double v) const { return cx + u * c + v * s; }
    double y(double u, double v) const { return cy - u * s + v * c; }
};

struct Upright {
    Frame frame;
    double u0, v0;    // of pixel (0, 0)
    ImageF filtered;  // blurred and opened along
    ImageF contrast;  // less what lies beside; 0 where it was not asked for
};

bool within(const ImageF& image, double x, double y)
{
    return x >= 0 && y >= 0 && x <= image.width() - 1 && y <= image.height() - 1;
}

double medianOf(std::vector<double>& values)
{
    if (values.empty()) return 0;
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

ImageF alongExtreme(const ImageF& from, bool greatest)
{
    ImageF to(from.width(), from.height(), 1);
    for (int y = 0; y < from.height(); ++y) {
        std::copy_n(from.row(y), from.width(), to.row(y));
        for (int k = -kOpening; k <= kOpening; ++k) {
            const float* other = from.row(std::clamp(y + k, 0, from.height() - 1));
            float* row = to.row(y);
            if (greatest)
                for (int x = 0; x < from.width(); ++x) row[x] = std::max(row[x], other[x]);
            else
                for (int x = 0; x < from.width(); ++x) row[x] = std::min(row[x], other[x]);
        }
    }
    return to;
}

Upright upright(const ImageF& alpha, double slant)
{
    Upright up;
    up.frame = {(alpha.width() - 1) / 2.0, (alpha.height() - 1) / 2.0, std::sin(slant), std::cos(slant)};
    const double s = std::abs(up.frame.s), c = std::abs(up.frame.c);
    // Pixels on pixels when nothing is turned: an odd size stays odd.
    const int width = int(std::ceil((alpha.width() - 1) * c + (alpha.height() - 1) * s - 1e-9)) + 1;
    const int height = int(std::ceil((alpha.height() - 1) * c + (alpha.width() - 1) * s - 1e-9)) + 1;
    up.u0 = -(width - 1) / 2.0, up.v0 = -(height - 1) / 2.0;
    ImageF turned(width, height, 1);
    for (int j = 0; j < height; ++j)
        for (int i = 0; i < width; ++i)
            turned.at(i, j) = float(linear(alpha, up.frame.x(up.u0 + i, up.v0 + j), up.frame.y(up.u0 + i, up.v0 + j)));

    std::array<float, 2 * kBlurReach + 1> kernel;
    double sum = 0;
    for (int k = -kBlurReach; k <= kBlurReach; ++k) sum += std::exp(-0.5 * k * k / (kBlur * kBlur));
    for (int k = -kBlurReach; k <= kBlurReach; ++k)
        kernel[std::size_t(k + kBlurReach)] = float(std::exp(-0.5 * k * k / (kBlur * kBlur)) / sum);
    ImageF blurred(width, height, 1, 0.0f);
    for (int j = 0; j < height; ++j)
        for (int k = -kBlurReach; k <= kBlurReach; ++k) {
            const float* other = turned.row(std::clamp(j + k, 0, height - 1));
            const float weight = kernel[std::size_t(k + kBlurReach)];
            float* row = blurred.row(j);
            for (int i = 0; i < width; ++i) row[i] += weight * other[i];
        }
    up.filtered = alongExtreme(alongExtreme(blurred, false), true);
    return up;
}

// The filtered value less the median of kBeside pixels on either side, maxWidth away.
float overSurroundings(const ImageF& filtered, int i, int j, int away)
{
    std::array<float, 2 * kBeside> beside;
    std::size_t n = 0;
    const float* row = filtered.row(j);
    for (int k = 0; k < kBeside; ++k) {
        if (i - away - k >= 0) beside[n++] = row[i - away - k];
        if (i + away + k < filtered.width()) beside[n++] = row[i + away + k];
    }
    if (n == 0) return 0;
    std::nth_element(beside.begin(), beside.begin() + std::ptrdiff_t(n / 2), beside.begin() + std::ptrdiff_t(n));
    return row[i] - beside[n / 2];
}

// One row of a ridge.
struct Segment {
    int row;
    double u;       // middle, weighted with the contrast [px of the upright picture]
    double height;  // greatest contrast
};
using Ridge = std::vector<Segment>;

// The pieces of a row that lie over `low`, parted at valleys.
void segmentsOf(const float* row, int width, int j, double low, double sigma, std::vector<Segment>& out)
{
    out.clear();
    const auto add = [&](int first, int last) {  // [first, last)
        double sum = 0, moment = 0, height = 0;
        for (int i = first; i < last; ++i) {
            sum += row[i], moment += double(row[i]) * i;
            height = std::max(height, double(row[i]));
        }
        out.push_back({j, moment / sum, height});
    };
    for (int i = 0; i < width;) {
        if (!(row[i] > low)) {
            ++i;
            continue;
        }
        int first = i, valley = i;
        float peak = row[i], lowest = row[i];
        for (; i < width && row[i] > low; ++i) {
            if (row[i] < lowest) lowest = row[i], valley = i;
            const float lesser = std::min(peak, row[i]);
            if (valley > first && lowest < 0.8f * lesser && lesser - lowest > 3 * sigma) {
                // The valley is real when the row has risen again on this side of it.
                add(first, valley);
                first = valley;
                peak = lowest = row[i];
            } else if (row[i] > peak) {
                peak = lowest = row[i];
                valley = i;
            }
        }
        add(first, i);
    }
}

std::vector<Ridge> ridgesOf(const Upright& up, double low, double sigma)
{
    std::vector<Ridge> done, open;
    std::vector<Segment> segments;
    for (int j = 0; j < up.contrast.height(); ++j) {
        segmentsOf(up.contrast.row(j), up.contrast.width(), j, low, sigma, segments);
        // Mutually nearest: neither end has a better partner. One row may be missing.
        std::vector<int> partner(segments.size(), -1);
        std::vector<Ridge> next;
        for (std::size_t r = 0; r < open.size(); ++r) {
            int best = -1;
            for (std::size_t n = 0; n < segments.size(); ++n)
                if (const double off = std::abs(segments[n].u - open[r].back().u);
                    off <= kLink && (best < 0 || off < std::abs(segments[std::size_t(best)].u - open[r].back().u)))
                    best = int(n);
            if (best < 0) continue;
            int& holder = partner[std::size_t(best)];
            const double u = segments[std::size_t(best)].u;
            if (holder < 0 || std::abs(open[r].back().u - u) < std::abs(open[std::size_t(holder)].back().u - u))
                holder = int(r);
        }
        std::vector<bool> taken(open.size(), false);
        for (std::size_t n = 0; n < segments.size(); ++n) {
            Ridge ridge;
            if (partner[n] >= 0) {
                ridge = std::move(open[std::size_t(partner[n])]);
                taken[std::size_t(partner[n])] = true;
            }
            ridge.push_back(segments[n]);
            next.push_back(std::move(ridge));
        }
        for (std::size_t r = 0; r < open.size(); ++r)
            if (!taken[r]) (open[r].back().row < j - 1 ? done : next).push_back(std::move(open[r]));
        open = std::move(next);
    }
    for (Ridge& ridge : open) done.push_back(std::move(ridge));
    std::sort(done.begin(), done.end(), [](const Ridge& a, const Ridge& b) {
        return a.front().row != b.front().row ? a.front().row < b.front().row : a.front().u < b.front().u;
    });
    return done;
}

struct Line {
    double u, v, slope, rms;  // through (u, v) [px of Frame]
};
Line lineThrough(const Ridge& ridge, const Upright& up)
{
    double w = 0, mu = 0, mv = 0, uv = 0, vv = 0, square = 0;
    for (const Segment& s : ridge) w += s.height, mu += s.height * s.u, mv += s.height * s.row;
    mu /= w, mv /= w;
    for (const Segment& s : ridge) {
        uv += s.height * (s.u - mu) * (s.row - mv);
        vv += s.height * (s.row - mv) * (s.row - mv);
    }
    const double slope = vv > 0 ? uv / vv : 0;
    for (const Segment& s : ridge) square += s.height * std::pow(s.u - mu - slope * (s.row - mv), 2);
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
        return medianOf(work);
    };
    for (int k = first + least; k < last - least; ++k) {
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

void measure(const ImageF& alpha, const Upright& up, const Ridge& ridge, int frame, double sigma,
             const RainStrokeOptions& options, int depth, std::vector<RainStroke>& out)
{
    int strong = 0;
    const double high = std::max(kHigh * sigma, options.minContrast);
    for (const Segment& s : ridge) strong += s.height > high;
    if (strong * 2 < options.minLength || ridge.size() < 3) return;

    const Line line = lineThrough(ridge, up);
    const double turn = std::atan(line.slope), slant = options.slant + turn;
    Frame own{up.frame.x(line.u, line.v), up.frame.y(line.u, line.v), std::sin(slant), std::cos(slant)};

    // A grid along the stroke's own line: rows of 1 px along, kStep across.
    const double from = (ridge.front().row + up.v0 - line.v) / std::cos(turn);
    const double to = (ridge.back().row + up.v0 - line.v) / std::cos(turn);
    const int rows = int(std::ceil(to - from)) + 1 + 2 * kPad, first = kPad, last = rows - kPad;
    const int half = int((options.maxWidth / 2 + 2) / kStep), columns = 2 * half + 1;
    const double top = from - kPad;
    Image<double> grid(columns, rows, 1);
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < columns; ++i)
            grid.at(i, j) = linear(alpha, own.x((i - half) * kStep, top + j), own.y((i - half) * kStep, top + j));

    RainStroke stroke;
    stroke.frame = frame;
    std::vector<double> profile(std::size_t(columns), 0.0), work;
    for (int j = first; j < last; ++j)
        for (int i = 0; i < columns; ++i) profile[std::size_t(i)] += grid.at(i, j) / (last - first);
    for (int j = first; j < last; ++j)
        for (int k = 0; k < kBeside; ++k)
            for (const double t : {options.maxWidth / 2 + 2.5 + k, -options.maxWidth / 2 - 2.5 - k})
                work.push_back(linear(alpha, own.x(t, top + j), own.y(t, top + j)));
    stroke.background = medianOf(work);
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
    for (int j = 0; j < rows; ++j) {
        double area = 0;
        for (int i = centre - side; i <= centre + side; ++i)
            raw[std::size_t(j)] += (grid.at(i, j) - stroke.background) / (2 * side + 1);
        for (int i = std::max(middle - left, 0); i <= std::min(middle + right, columns - 1); ++i)
            area += std::max(grid.at(i, j) - stroke.background, 0.0) * kStep;
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
            for (const Segment& s : ridge)
                ((s.row + up.v0 - line.v) / std::cos(turn) < top + parting ? before : after).push_back(s);
            if (!before.empty() && !after.empty()) {
                measure(alpha, up, before, frame, sigma, options, depth + 1, out);
                measure(alpha, up, after, frame, sigma, options, depth + 1, out);
                return;
            }
        }

    work.assign(along.begin() + first, along.begin() + last);
    stroke.contrast = medianOf(work);
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
    const int lower = std::max(middle - left, 0), upper = std::min(middle + right, columns - 1);
    const double margin = std::max(stroke.width, 2.0) / 2;
    double energy = 0, explained = 0, norm = 0;
    for (int i = lower; i <= upper; ++i) norm += profile[std::size_t(i)] * profile[std::size_t(i)];
    for (int j = 0; j < rows; ++j) {
        if (top + j < begin - margin || top + j > end + margin) continue;
        double projection = 0;
        for (int i = lower; i <= upper; ++i) {
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
    const Frame& frameUp = up.frame;
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
        for (double w = 4; w <= 8; w += 1) around(t, begin - kBlur - w), around(t, end + kBlur + w);
    if (!work.empty()) {
        const auto decile = work.begin() + std::ptrdiff_t(work.size() * 9 / 10);
        std::nth_element(work.begin(), decile, work.end());
        stroke.isolation = std::clamp(1 - std::max(*decile - sigma, 0.0) / stroke.contrast, 0.0, 1.0);
    }

    stroke.inside = true;
    for (const double w : {begin - 1, end + 1})
        for (const double t : {-stroke.width / 2 - 0.5, stroke.width / 2 + 0.5})
            stroke.inside = stroke.inside && within(alpha, own.x(across + t, w), own.y(across + t, w));
    if (stroke.inside)
        stroke.score = stroke.straightness * stroke.isolation * stroke.plainness * stroke.plainness *
                       std::sqrt(stroke.sharpness) * std::min(1.0, stroke.length / (4 * stroke.width)) *
                       std::min(1.0, 1.5 * stroke.contrast / stroke.peak) * stroke.contrast /
                       (stroke.contrast + 4 * sigma);
    out.push_back(stroke);
}

std::vector<RainStroke> strokesIn(const ImageF& given, int frame, const RainStrokeOptions& options)
{
    std::vector<RainStroke> found;
    if (given.empty()) return found;
    ImageF alpha = given;
    for (float& value : alpha.values())
        if (!std::isfinite(value)) value = 0;
    Upright up = upright(alpha, options.slant);
    const int away = int(std::ceil(options.maxWidth / 2)) + 2;
    const auto inFrame = [&](int i, int j) {
        return within(alpha, up.frame.x(up.u0 + i, up.v0 + j), up.frame.y(up.u0 + i, up.v0 + j));
    };

    // Every 3rd pixel of every 5th row is enough to know the spread.
    std::vector<double> spread;
    for (int j = 0; j < up.filtered.height(); j += 5)
        for (int i = 0; i < up.filtered.width(); i += 3)
            if (inFrame(i, j)) spread.push_back(std::abs(overSurroundings(up.filtered, i, j, away)));
    // Noise that was smoothed by a Gaussian of deviation a loses (a^2 / (a^2 + b^2))^1/4 to another of deviation b.
    const double smooth = options.noiseAlong * options.noiseAlong;
    const double gain = std::max(kBlurGain, std::pow(smooth / (smooth + kBlur * kBlur), 0.25));
    const double sigma = std::max(gain * options.noise, 1.4826 * medianOf(spread));
    const double low = std::max(kLow * sigma, options.minContrast / 2);

    up.contrast = ImageF(up.filtered.width(), up.filtered.height(), 1, 0.0f);
    for (int j = 0; j < up.filtered.height(); ++j)
        for (int i = 0; i < up.filtered.width(); ++i)
            if (up.filtered.at(i, j) > low && inFrame(i, j))
                up.contrast.at(i, j) = std::max(0.0f, overSurroundings(up.filtered, i, j, away));
    for (const Ridge& ridge : ridgesOf(up, low, sigma)) measure(alpha, up, ridge, frame, sigma, options, 0, found);
    return found;
}

}  // namespace

std::vector<RainStroke> findRainStrokes(std::span<const ImageF> alphas, const RainStrokeOptions& options)
{
    if (!(std::abs(options.slant) <= std::numbers::pi / 2 + 1e-9))
        throw Error(ErrorCode::InvalidArgument, "the slant of the rain is {} rad, not within -pi/2..pi/2",
                    options.slant);
    if (!(options.noise >= 0) || !std::isfinite(options.noise))
        throw Error(ErrorCode::InvalidArgument, "the noise of alpha is {}, not 0 or more", options.noise);
    if (!(options.noiseAlong >= 0) || !std::isfinite(options.noiseAlong))
        throw Error(ErrorCode::InvalidArgument, "the noise of alpha is smooth over {} px, not 0 or more",
                    options.noiseAlong);
    if (!(options.maxWidth >= 1 && options.maxWidth <= 64))
        throw Error(ErrorCode::InvalidArgument, "the widest stroke is {} px, not within 1..64", options.maxWidth);
    for (const ImageF& alpha : alphas)
        if (!alpha.empty() && alpha.channels() != 1)
            throw Error(ErrorCode::Internal, "an alpha has {} channels, not 1", alpha.channels());

    std::vector<std::vector<RainStroke>> found(alphas.size());
    parallelFor(0, std::ptrdiff_t(alphas.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (std::ptrdiff_t k = first; k < last; ++k)
            found[std::size_t(k)] = strokesIn(alphas[std::size_t(k)], int(k), options);
    });
    std::vector<RainStroke> all;
    for (const auto& some : found) all.insert(all.end(), some.begin(), some.end());
    return all;
}

RainStatistics rainStatistics(std::span<const RainStroke> strokes, std::span<const ImageF> alphas)
{
    RainStatistics statistics;
    statistics.count = int(strokes.size());
    std::vector<double> weights, lengths;
    for (const RainStroke& stroke : strokes) {
        const double quality = stroke.isolation * stroke.straightness * stroke.plainness;
        weights.push_back(std::pow(stroke.length, 3) * (quality * quality + 1e-6));
        if (!stroke.inside) continue;
        lengths.push_back(stroke.length);
        statistics.meanLength += stroke.length, statistics.meanWidth += stroke.width;
    }
    // The mean of all, then three times again with a biweight about the last one, six median deviations wide.
    for (int round = 0; round < 4; ++round) {
        std::vector<double> off;
        for (const RainStroke& stroke : strokes)
            off.push_back(std::abs(std::remainder(stroke.slant - statistics.slant, std::numbers::pi)));
        std::vector<double> work = off;
        const double reach = round == 0 ? 0.0 : 6 * medianOf(work);
        std::complex<double> sum = 0;
        double total = 0;
        for (std::size_t n = 0; n < strokes.size(); ++n) {
            const double t = reach > 0 ? std::min(off[n] / reach, 1.0) : 0.0;
            const double weight = weights[n] * (1 - t * t) * (1 - t * t);
            sum += std::polar(weight, 2 * strokes[n].slant), total += weight;
        }
        if (!(std::abs(sum) > 0)) break;
        statistics.slant = std::arg(sum) / 2;
        // The spread is that of all.
        if (round == 0)
            statistics.slantSpread = std::sqrt(std::max(0.0, -2 * std::log(std::min(1.0, std::abs(sum) / total)))) / 2;
    }
    if (!lengths.empty()) {
        statistics.meanLength /= double(lengths.size()), statistics.meanWidth /= double(lengths.size());
        statistics.medianLength = medianOf(lengths);
    }
    double pixels = 0;
    for (const ImageF& alpha : alphas) pixels += double(alpha.width()) * alpha.height();
    if (pixels > 0) statistics.density = statistics.count / pixels * 1e6;
    return statistics;
}

}  // namespace virga::matte
