#include "sh/Harmonics.h"

#include <Eigen/Core>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <complex>
#include <glm/geometric.hpp>
#include <numbers>

#include "core/Error.h"
#include "core/Parallel.h"
#include "sh/RowTransform.h"

namespace virga::sh {
namespace {

constexpr double pi = std::numbers::pi;
using Complex = std::complex<double>;

/// P_mm = seed(m) sin^m t.
double seed(int m)
{
    double square = 1.0 / (4.0 * pi);
    for (int k = 1; k <= m; ++k) square *= (2.0 * k + 1.0) / (2.0 * k);
    return std::sqrt(square);
}

/// P_lm = a (cos t P_(l-1)m - b P_(l-2)m), l > m.
struct Step {
    double a, b;
    Step(int l, int m)
        : a(std::sqrt((4.0 * l * l - 1.0) / (double(l) * l - double(m) * m))),
          b(l == m + 1 ? 0.0
                       : std::sqrt((double(l - 1) * (l - 1) - double(m) * m) / (4.0 * double(l - 1) * (l - 1) - 1.0)))
    {
    }
};

/// Angles at which Legendre functions are worked out: `perRow` to a row of the map, with the weights that make of them
/// the row's part of an integral over cos t.
struct Rows {
    int perRow;
    std::vector<double> sine, cosine, weight;

    /// The rows' centres, with the weights of rowWeights().
    explicit Rows(int height) : perRow(1), weight(rowWeights(height))
    {
        for (int j = 0; j < height; ++j) add((j + 0.5) / height * pi);
    }

    /// Gauss-Legendre nodes within each row, as many as integrate P_lm sin t to rounding for l <= order.
    Rows(int height, int order)
    {
        // The integrand holds no waves faster than order + 1: over half a row they turn by this much.
        const double turn = 0.5 * pi / height * (order + 1);
        perRow = turn < 0.02 ? 3 : turn < 0.15 ? 4 : turn < 1.0 ? 8 : 9 + int(turn);
        const auto [node, share] = gaussLegendre(perRow);
        for (int j = 0; j < height; ++j) {
            for (int k = 0; k < perRow; ++k) {
                add((j + 0.5 + 0.5 * node[std::size_t(k)]) / height * pi);
                weight.push_back(0.5 * pi / height * share[std::size_t(k)] * sine.back());
            }
        }
    }

private:
    void add(double t)
    {
        sine.push_back(std::sin(t));
        cosine.push_back(std::cos(t));
    }

    struct Rule {
        std::vector<double> node, weight;
    };
    /// On [-1, 1]: Newton's method on P_n, from Abramowitz & Stegun 22.16.6.
    static Rule gaussLegendre(int n)
    {
        Rule rule;
        for (int i = 0; i < n; ++i) {
            double x = std::cos(pi * (i + 0.75) / (n + 0.5)), slope = 1.0;
            for (int step = 0; step < 10; ++step) {
                double before = 0.0, here = 1.0;
                for (int k = 1; k <= n; ++k) {
                    const double next = ((2 * k - 1) * x * here - (k - 1) * before) / k;
                    before = here;
                    here = next;
                }
                slope = n * (x * here - before) / (x * x - 1.0);
                x -= here / slope;
            }
            rule.node.push_back(x);
            rule.weight.push_back(2.0 / ((1.0 - x * x) * slope * slope));
        }
        return rule;
    }
};

/// Calls visit(l, values) for l = m to order with P_lm at every row.
template <class Visit>
void forEachDegree(int m, int order, const Rows& rows, Visit&& visit)
{
    const std::size_t height = rows.sine.size();
    std::vector<double> before(height, 0.0), here(height), next(height);
    const double start = seed(m);
    for (std::size_t j = 0; j < height; ++j) here[j] = start * std::pow(rows.sine[j], m);
    visit(m, here);
    for (int l = m + 1; l <= order; ++l) {
        const Step step(l, m);
        for (std::size_t j = 0; j < height; ++j) {
            next[j] = step.a * (rows.cosine[j] * here[j] - step.b * before[j]);
        }
        std::swap(before, here);
        std::swap(here, next);
        visit(l, here);
    }
}

/// Fourier coefficients of all rows: for each m and channel a run of `height` cosines and one of sines.
class RowSpectra {
public:
    RowSpectra(int order, int height) : height_(std::size_t(height)), values_(std::size_t(order + 1) * 6 * height_) {}
    double* cosine(int m, int channel)
    {
        return values_.data() + (std::size_t(m) * 6 + std::size_t(channel)) * height_;
    }
    double* sine(int m, int channel) { return cosine(m, channel + 3); }

private:
    std::size_t height_;
    std::vector<double> values_;
};

/// Calls visit(firstRow, rows) for blocks that RowTransform takes at once.
template <class Visit>
void forEachBlock(int height, int width, Visit&& visit)
{
    constexpr int step = RowTransform::rowsAtOnce;
    parallelFor(0, (height + step - 1) / step, std::max(1, 8192 / width),
                [&](std::ptrdiff_t first, std::ptrdiff_t last) {
                    for (int block = int(first); block < int(last); ++block) {
                        visit(block * step, std::min(step, height - block * step));
                    }
                });
}

void checkOrder(int order)
{
    if (order < 0 || order > maxOrder) {
        throw Error(ErrorCode::InvalidArgument, "spherical harmonics of order {}: must be from 0 to {}", order,
                    maxOrder);
    }
}

}  // namespace

std::vector<double> basis(int order, const glm::dvec3& direction)
{
    checkOrder(order);
    std::vector<double> y(coefficientCount(order));
    const double sine = std::hypot(direction.x, direction.z);
    const double cosine = direction.y;
    const Complex turn = sine > 0.0 ? Complex(-direction.z, -direction.x) / sine : Complex(1.0);
    Complex phase = 1.0;
    double diagonal = seed(0);
    for (int m = 0; m <= order; ++m) {
        const double real = m == 0 ? 1.0 : std::numbers::sqrt2 * phase.real();
        const double imaginary = std::numbers::sqrt2 * phase.imag();
        double before = 0.0, here = diagonal;
        for (int l = m; l <= order; ++l) {
            if (l > m) {
                const Step step(l, m);
                const double next = step.a * (cosine * here - step.b * before);
                before = here;
                here = next;
            }
            y[coefficientIndex(l, m)] = here * real;
            if (m > 0) y[coefficientIndex(l, -m)] = here * imaginary;
        }
        diagonal *= sine * std::sqrt((2.0 * m + 3.0) / (2.0 * m + 2.0));
        phase *= turn;
    }
    return y;
}

std::vector<double> rowWeights(int height)
{
    assert(height > 0);
    // w_j = 2/H (1 - 2 sum_{k=1}^{H/2} cos(2 k t_j) / (4 k^2 - 1)), t_j = (j + 1/2) pi / H; the cosines repeat.
    const std::size_t period = 2 * std::size_t(height);
    std::vector<double> cosine(period);
    for (std::size_t i = 0; i < period; ++i) cosine[i] = std::cos(pi * double(i) / height);
    std::vector<double> weight(std::size_t(height), 0.0);
    for (std::size_t j = 0; j < weight.size(); ++j) {
        double sum = 0.0;
        for (std::size_t k = weight.size() / 2; k >= 1; --k) {
            sum += cosine[k * (2 * j + 1) % period] / (4.0 * double(k) * double(k) - 1.0);
        }
        weight[j] = 2.0 / height * (1.0 - 2.0 * sum);
    }
    return weight;
}

Harmonics projectPanorama(ConstImageViewF map, int order, PixelValue pixels)
{
    checkOrder(order);
    assert(map.channels() >= 3);
    const int width = map.width(), height = map.height();
    if (pixels == PixelValue::Sample && 2 * order >= std::min(width, height)) {
        throw Error(ErrorCode::InvalidArgument,
                    "spherical harmonics of order {} from a map of {} x {} pixels: it holds order {} at most", order,
                    width, height, (std::min(width, height) - 1) / 2);
    }

    // Along the rows: integrals of f cos(m p) and f sin(m p).
    RowSpectra spectra(order, height);
    const RowTransform transform(order, width);
    forEachBlock(height, width, [&](int first, int rows) {
        const RowTransform::Sums sums = transform.forward(map, first, rows);
        for (int m = 0; m <= order; ++m) {
            // Over a pixel's width cos(m p) has the mean sin(x) / x of its middle, x = m pi / width.
            const double x = m * pi / width;
            const double mean = pixels == PixelValue::Mean && m > 0 ? std::sin(x) / x : 1.0;
            const double scale = 2.0 * pi / width * mean * (m == 0 ? 1.0 : std::numbers::sqrt2);
            for (int row = 0; row < rows; ++row) {
                for (int channel = 0; channel < 3; ++channel) {
                    spectra.cosine(m, channel)[first + row] = scale * sums.cosine[sums.at(m, row, channel)];
                    spectra.sine(m, channel)[first + row] = scale * sums.sine[sums.at(m, row, channel)];
                }
            }
        }
    });

    // Down the columns, one m at a time.
    Harmonics result(order);
    const Rows rows = pixels == PixelValue::Mean ? Rows(height, order) : Rows(height);
    parallelFor(0, order + 1, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        Eigen::VectorXd weighted(height);
        for (int m = int(first); m < int(last); ++m) {
            const Eigen::Map<const Eigen::MatrixXd> parts(spectra.cosine(m, 0), height, 6);
            forEachDegree(m, order, rows, [&](int l, const std::vector<double>& legendre) {
                const double *value = legendre.data(), *weight = rows.weight.data();
                for (int j = 0; j < height; ++j) {
                    double sum = 0.0;
                    for (int k = 0; k < rows.perRow; ++k) sum += *weight++ * *value++;
                    weighted[j] = sum;
                }
                const Eigen::Vector<double, 6> sum = parts.transpose() * weighted;
                result.coefficient[coefficientIndex(l, m)] = {sum[0], sum[1], sum[2]};
                if (m > 0) result.coefficient[coefficientIndex(l, -m)] = {sum[3], sum[4], sum[5]};
            });
        }
    });
    return result;
}

void convolve(Harmonics& harmonics, const std::vector<double> (&factor)[3])
{
    for (int l = 0; l <= harmonics.order; ++l) {
        glm::dvec3 f(0.0);
        for (int channel = 0; channel < 3; ++channel) {
            if (std::size_t(l) < factor[channel].size()) f[channel] = factor[channel][std::size_t(l)];
        }
        for (int m = -l; m <= l; ++m) harmonics.coefficient[coefficientIndex(l, m)] *= f;
    }
}

Harmonics truncated(const Harmonics& harmonics, int order)
{
    Harmonics result(std::min(order, harmonics.order));
    std::copy_n(harmonics.coefficient.begin(), result.coefficient.size(), result.coefficient.begin());
    return result;
}

glm::dvec3 evaluate(const Harmonics& harmonics, const glm::dvec3& direction)
{
    const std::vector<double> y = basis(harmonics.order, direction);
    glm::dvec3 sum(0.0);
    for (std::size_t i = 0; i < y.size(); ++i) sum += y[i] * harmonics.coefficient[i];
    return sum;
}

ImageF bakePanorama(const Harmonics& harmonics, int width, int height)
{
    const int order = harmonics.order;
    assert(width > 2 * order && height > 0);

    RowSpectra spectra(order, height);
    const Rows rows(height);
    parallelFor(0, order + 1, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int m = int(first); m < int(last); ++m) {
            const double norm = m == 0 ? 1.0 : std::numbers::sqrt2;
            Eigen::Map<Eigen::MatrixXd> parts(spectra.cosine(m, 0), height, 6);
            forEachDegree(m, order, rows, [&](int l, const std::vector<double>& legendre) {
                const glm::dvec3 cosine = norm * harmonics.coefficient[coefficientIndex(l, m)];
                const glm::dvec3 sine = m > 0 ? norm * harmonics.coefficient[coefficientIndex(l, -m)] : glm::dvec3(0.0);
                const Eigen::Map<const Eigen::VectorXd> values(legendre.data(), height);
                for (int channel = 0; channel < 3; ++channel) {
                    parts.col(channel) += cosine[channel] * values;
                    if (m > 0) parts.col(channel + 3) += sine[channel] * values;
                }
            });
        }
    });

    ImageF map(width, height, 3);
    const RowTransform transform(order, width);
    forEachBlock(height, width, [&](int first, int count) {
        RowTransform::Sums sums(order, count);
        for (int m = 0; m <= order; ++m) {
            for (int row = 0; row < count; ++row) {
                for (int channel = 0; channel < 3; ++channel) {
                    sums.cosine[sums.at(m, row, channel)] = spectra.cosine(m, channel)[first + row];
                    sums.sine[sums.at(m, row, channel)] = spectra.sine(m, channel)[first + row];
                }
            }
        }
        transform.backward(sums, map, first, count);
    });
    return map;
}

std::vector<glm::dvec3> bandEnergies(const Harmonics& harmonics)
{
    std::vector<glm::dvec3> energy(std::size_t(harmonics.order) + 1, glm::dvec3(0.0));
    for (int l = 0; l <= harmonics.order; ++l) {
        for (int m = -l; m <= l; ++m) {
            const glm::dvec3& c = harmonics.coefficient[coefficientIndex(l, m)];
            energy[std::size_t(l)] += c * c;
        }
    }
    return energy;
}

}  // namespace virga::sh
