#include "matte/StrokeRidges.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/Simd.h"
#include "matte/SortingNetwork.h"

namespace virga::matte {
namespace {

constexpr int kBlurReach = 6;        // [px], 3 sigma
constexpr double kBlurGain = 0.376;  // standard deviation of white noise after it: (2 sqrt(pi) strokeBlur)^-1/2
constexpr int kOpening = 2;          // half length of the opening along [px]
constexpr double kLow = 2.5;
constexpr int kBeside = 8;     // [px] across, each side: what a pixel is compared with
constexpr double kLink = 1.5;  // [px] across from one row to the next: ridges of 45 degrees off are none
constexpr int kTile = 32;      // [px], whose surroundings are sorted together

// The value at a point, linear between pixels, with bounds that repeat.
float linear(const ImageF& image, double x, double y)
{
    x = std::clamp(x, 0.0, image.width() - 1.0), y = std::clamp(y, 0.0, image.height() - 1.0);
    const int i = int(x), j = int(y), right = i + 1 < image.width() ? 1 : 0;
    const float *row = image.row(j) + i, *below = j + 1 < image.height() ? image.row(j + 1) + i : row;
    const double f = x - i, g = y - j;
    return float((1 - g) * ((1 - f) * row[0] + f * row[right]) + g * ((1 - f) * below[0] + f * below[right]));
}

// Points whose four pixels are inside: x and y are from pixel `origin`, and not negative.
VIRGA_SIMD void sampleInside(const float* origin, int stride, float x, float y, float dx, float dy, int first, int last,
                             float* __restrict to)
{
    for (int n = first; n < last; ++n) {
        const float u = x + float(n) * dx, v = y + float(n) * dy;
        const int i = int(u), j = int(v), at = j * stride + i;
        const float f = u - float(i), g = v - float(j);
        to[n] = (1 - g) * ((1 - f) * origin[at] + f * origin[at + 1]) +
                g * ((1 - f) * origin[at + stride] + f * origin[at + stride + 1]);
    }
}

// The i in [first, last) for which from + i step lies within [0, below), narrowed by a hair.
void narrow(double from, double step, double below, int& first, int& last)
{
    constexpr double hair = 1e-3;
    const auto inside = [&](int i) { return from + i * step >= hair && from + i * step < below - hair; };
    if (std::abs(step) > 1e-9) {
        const double a = -from / step, b = (below - from) / step;
        first = std::max(first, int(std::clamp(std::min(a, b), -1e9, 1e9)));
        last = std::min(last, int(std::clamp(std::max(a, b), -1e9, 1e9)) + 1);
    }
    while (first < last && !inside(first)) ++first;
    while (first < last && !inside(last - 1)) --last;
}

// Rows of weighted rows, and of the least and greatest of rows.

VIRGA_SIMD void blurRow(const float* const* rows, const float* weights, int count, float* __restrict to)
{
    for (int i = 0; i < count; ++i) to[i] = weights[0] * rows[0][i];
    for (int k = 1; k <= 2 * kBlurReach; ++k) {
        const float *row = rows[k], weight = weights[k];
        for (int i = 0; i < count; ++i) to[i] += weight * row[i];
    }
}
VIRGA_SIMD void lowerRow(const float* __restrict row, int count, float* __restrict to)
{
    for (int i = 0; i < count; ++i) to[i] = row[i] < to[i] ? row[i] : to[i];
}
VIRGA_SIMD void raiseRow(const float* __restrict row, int count, float* __restrict to)
{
    for (int i = 0; i < count; ++i) to[i] = to[i] < row[i] ? row[i] : to[i];
}

void alongExtreme(const ImageF& from, bool greatest, ImageF& to)
{
    for (int y = 0; y < from.height(); ++y) {
        std::copy_n(from.row(y), from.width(), to.row(y));
        for (int k = -kOpening; k <= kOpening; ++k) {
            const float* other = from.row(std::clamp(y + k, 0, from.height() - 1));
            if (k != 0) greatest ? raiseRow(other, from.width(), to.row(y)) : lowerRow(other, from.width(), to.row(y));
        }
    }
}

StrokeRidges upright(const ImageF& alpha, double slant)
{
    StrokeRidges up{};
    up.frame = {(alpha.width() - 1) / 2.0, (alpha.height() - 1) / 2.0, std::sin(slant), std::cos(slant)};
    const double s = std::abs(up.frame.s), c = std::abs(up.frame.c);
    // Pixels on pixels when nothing is turned: an odd size stays odd.
    const int width = int(std::ceil((alpha.width() - 1) * c + (alpha.height() - 1) * s - 1e-9)) + 1;
    const int height = int(std::ceil((alpha.height() - 1) * c + (alpha.width() - 1) * s - 1e-9)) + 1;
    up.u0 = -(width - 1) / 2.0, up.v0 = -(height - 1) / 2.0;
    ImageF turned(width, height, 1);
    for (int j = 0; j < height; ++j)
        sampleLine(alpha, up.frame.x(up.u0, up.v0 + j), up.frame.y(up.u0, up.v0 + j), up.frame.c, -up.frame.s, width,
                   turned.row(j));

    std::array<float, 2 * kBlurReach + 1> kernel;
    std::array<const float*, kernel.size()> rows;
    double sum = 0;
    for (int k = -kBlurReach; k <= kBlurReach; ++k) sum += std::exp(-0.5 * k * k / (strokeBlur * strokeBlur));
    for (int k = -kBlurReach; k <= kBlurReach; ++k)
        kernel[std::size_t(k + kBlurReach)] = float(std::exp(-0.5 * k * k / (strokeBlur * strokeBlur)) / sum);
    up.filtered = ImageF(width, height, 1);
    for (int j = 0; j < height; ++j) {
        for (int k = -kBlurReach; k <= kBlurReach; ++k)
            rows[std::size_t(k + kBlurReach)] = turned.row(std::clamp(j + k, 0, height - 1));
        blurRow(rows.data(), kernel.data(), width, up.filtered.row(j));
    }
    alongExtreme(up.filtered, false, turned);
    alongExtreme(turned, true, up.filtered);
    return up;
}

// The medians of kBeside pixels on either side of each pixel, `away` from it; beyond the ends there are none.
class Surroundings {
public:
    explicit Surroundings(int away) : away_(away), network_(medianNetwork(2 * kBeside)) {}

    // Of pixels [first, last), kTile of them at most.
    void ask(const float* row, int width, int first, int last, float* to)
    {
        const int reach = away_ + kBeside - 1;
        if (first < reach || last - first < kTile || last + reach > width) {
            for (int i = first; i < last; ++i) to[i - first] = one(row, width, i);
            return;
        }
        for (int k = 0; k < kBeside; ++k) {
            std::copy_n(row + first - away_ - k, kTile, values_.data() + 2 * k * kTile);
            std::copy_n(row + first + away_ + k, kTile, values_.data() + (2 * k + 1) * kTile);
        }
        exchangeRows(values_.data(), kTile, network_);
        std::copy_n(values_.data() + kBeside * kTile, kTile, to);
    }

private:
    float one(const float* row, int width, int i) const
    {
        std::array<float, 2 * kBeside> beside;
        std::size_t n = 0;
        for (int k = 0; k < kBeside; ++k) {
            if (i - away_ - k >= 0) beside[n++] = row[i - away_ - k];
            if (i + away_ + k < width) beside[n++] = row[i + away_ + k];
        }
        if (n == 0) return row[i];
        std::nth_element(beside.begin(), beside.begin() + std::ptrdiff_t(n / 2), beside.begin() + std::ptrdiff_t(n));
        return beside[n / 2];
    }

    int away_;
    std::vector<std::pair<int, int>> network_;
    std::array<float, 2 * kBeside * kTile> values_;
};

// The pieces of a row that lie over `low`, parted at valleys.
void segmentsOf(const float* row, int width, int j, double low, double sigma, std::vector<RidgeRow>& out)
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

std::vector<Ridge> ridgesOf(const ImageF& contrast, double low, double sigma)
{
    std::vector<Ridge> done, open;
    std::vector<RidgeRow> segments;
    for (int j = 0; j < contrast.height(); ++j) {
        segmentsOf(contrast.row(j), contrast.width(), j, low, sigma, segments);
        // Mutually nearest: neither end has a better partner. One row may be missing.
        std::vector<int> partner(segments.size(), -1);
        std::vector<Ridge> next;
        for (std::size_t r = 0; r < open.size(); ++r) {
            int best = -1;
            const double last = open[r].back().u;
            const auto from = std::lower_bound(segments.begin(), segments.end(), last - kLink,
                                               [](const RidgeRow& row, double u) { return row.u < u; });
            for (auto n = std::size_t(from - segments.begin()); n < segments.size() && segments[n].u <= last + kLink;
                 ++n)
                if (best < 0 || std::abs(segments[n].u - last) < std::abs(segments[std::size_t(best)].u - last))
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

}  // namespace

bool isWithin(const ImageF& image, double x, double y)
{
    return x >= 0 && y >= 0 && x <= image.width() - 1 && y <= image.height() - 1;
}

double upperMedian(std::vector<double>& values)
{
    if (values.empty()) return 0;
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

void sampleLine(const ImageF& image, double x, double y, double dx, double dy, int count, float* to)
{
    int first = 0, last = count;
    narrow(x, dx, image.width() - 1, first, last);
    narrow(y, dy, image.height() - 1, first, last);
    first = std::min(first, count);
    last = std::max(first, last);
    for (int n = 0; n < first; ++n) to[n] = linear(image, x + n * dx, y + n * dy);
    for (int n = last; n < count; ++n) to[n] = linear(image, x + n * dx, y + n * dy);
    if (first == last) return;
    // From a pixel nearby, so that float holds the places.
    const int left = int(std::min(x + first * dx, x + (last - 1) * dx));
    const int top = int(std::min(y + first * dy, y + (last - 1) * dy));
    sampleInside(image.row(top) + left, image.width(), float(x - left), float(y - top), float(dx), float(dy), first,
                 last, to);
}

StrokeRidges strokeRidges(const ImageF& alpha, const RainStrokeOptions& options)
{
    StrokeRidges up = upright(alpha, options.slant);
    const int width = up.filtered.width(), height = up.filtered.height();
    Surroundings surroundings(int(std::ceil(options.maxWidth / 2)) + 2);
    const auto inFrame = [&](int i, int j) {
        return isWithin(alpha, up.frame.x(up.u0 + i, up.v0 + j), up.frame.y(up.u0 + i, up.v0 + j));
    };
    std::array<float, kTile> beside;

    // Every 3rd pixel of every 5th row, or of 100 rows, is enough to know the spread.
    std::vector<double> spread;
    for (int j = 0; j < height; j += std::max(5, height / 100))
        for (int left = 0; left < width; left += kTile) {
            const float* row = up.filtered.row(j);
            const int right = std::min(width, left + kTile);
            surroundings.ask(row, width, left, right, beside.data());
            for (int i = left + (3 - left % 3) % 3; i < right; i += 3)
                if (inFrame(i, j)) spread.push_back(std::abs(row[i] - beside[std::size_t(i - left)]));
        }
    // Noise that was smoothed by a Gaussian of deviation a loses (a^2 / (a^2 + b^2))^1/4 to another of deviation b.
    const double smooth = options.noiseAlong * options.noiseAlong;
    const double gain = std::max(kBlurGain, std::pow(smooth / (smooth + strokeBlur * strokeBlur), 0.25));
    up.sigma = std::max(gain * options.noise, 1.4826 * upperMedian(spread));
    const double low = std::max(kLow * up.sigma, options.minContrast / 2);

    ImageF contrast(width, height, 1);
    for (int j = 0; j < height; ++j)
        for (int left = 0; left < width; left += kTile) {
            const float* row = up.filtered.row(j);
            const int right = std::min(width, left + kTile);
            if (std::none_of(row + left, row + right, [&](float value) { return value > low; })) continue;
            surroundings.ask(row, width, left, right, beside.data());
            for (int i = left; i < right; ++i)
                if (row[i] > low && inFrame(i, j))
                    contrast.at(i, j) = std::max(0.0f, row[i] - beside[std::size_t(i - left)]);
        }
    up.ridges = ridgesOf(contrast, low, up.sigma);
    return up;
}

}  // namespace virga::matte
