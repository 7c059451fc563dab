#include "sh/Harmonics.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <complex>
#include <glm/geometric.hpp>
#include <numbers>
#include <unsupported/Eigen/FFT>

#include "core/Error.h"
#include "core/Parallel.h"

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

/// Sines and cosines of the rows' centres.
struct Rows {
    std::vector<double> sine, cosine;

    explicit Rows(int height) : sine(std::size_t(height)), cosine(std::size_t(height))
    {
        for (int j = 0; j < height; ++j) {
            const double t = (j + 0.5) / height * pi;
            sine[std::size_t(j)] = std::sin(t);
            cosine[std::size_t(j)] = std::cos(t);
        }
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

Harmonics projectPanorama(ConstImageViewF map, int order)
{
    checkOrder(order);
    assert(map.channels() >= 3);
    const int width = map.width(), height = map.height();
    if (2 * order >= std::min(width, height)) {
        throw Error(ErrorCode::InvalidArgument,
                    "spherical harmonics of order {} from a map of {} x {} pixels: it holds order {} at most", order,
                    width, height, (std::min(width, height) - 1) / 2);
    }

    // Along the rows: integrals of f cos(m p) and f sin(m p), p = -azimuth of the column.
    RowSpectra spectra(order, height);
    parallelFor(0, height, std::max(1, 65536 / std::max(width, 1)), [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        Eigen::FFT<double> fft;
        std::vector<double> samples(static_cast<std::size_t>(width));
        std::vector<Complex> spectrum;
        for (std::ptrdiff_t j = first; j < last; ++j) {
            const float* row = map.row(int(j));
            for (int channel = 0; channel < 3; ++channel) {
                for (int i = 0; i < width; ++i) samples[std::size_t(i)] = row[i * map.channels() + channel];
                fft.fwd(spectrum, samples);
                for (int m = 0; m <= order; ++m) {
                    // Columns sit at azimuth 2 pi (i + 1/2) / W - pi.
                    const Complex phase = std::polar(2.0 * pi / width, m * (pi - pi / width));
                    const Complex integral = phase * spectrum[std::size_t(m) % spectrum.size()];
                    spectra.cosine(m, channel)[j] = integral.real();
                    spectra.sine(m, channel)[j] = integral.imag();
                }
            }
        }
    });

    // Down the columns, one m at a time.
    Harmonics result(order);
    const Rows rows(height);
    const std::vector<double> weight = rowWeights(height);
    parallelFor(0, order + 1, 4, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int m = int(first); m < int(last); ++m) {
            const double norm = m == 0 ? 1.0 : std::numbers::sqrt2;
            double* part[6];
            for (int channel = 0; channel < 3; ++channel) {
                part[channel] = spectra.cosine(m, channel);
                part[channel + 3] = spectra.sine(m, channel);
            }
            for (double* values : part) {
                for (int j = 0; j < height; ++j) values[j] *= norm * weight[std::size_t(j)];
            }
            forEachDegree(m, order, rows, [&](int l, const std::vector<double>& legendre) {
                double sum[6] = {};
                for (int j = 0; j < height; ++j) {
                    for (int k = 0; k < 6; ++k) sum[k] += legendre[std::size_t(j)] * part[k][j];
                }
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
    parallelFor(0, order + 1, 4, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int m = int(first); m < int(last); ++m) {
            const double norm = m == 0 ? 1.0 : std::numbers::sqrt2;
            forEachDegree(m, order, rows, [&](int l, const std::vector<double>& legendre) {
                const glm::dvec3 cosine = norm * harmonics.coefficient[coefficientIndex(l, m)];
                const glm::dvec3 sine = m > 0 ? norm * harmonics.coefficient[coefficientIndex(l, -m)] : glm::dvec3(0.0);
                for (int channel = 0; channel < 3; ++channel) {
                    double* c = spectra.cosine(m, channel);
                    double* s = spectra.sine(m, channel);
                    for (int j = 0; j < height; ++j) {
                        c[j] += cosine[channel] * legendre[std::size_t(j)];
                        s[j] += sine[channel] * legendre[std::size_t(j)];
                    }
                }
            });
        }
    });

    ImageF map(width, height, 3);
    parallelFor(0, height, std::max(1, 65536 / width), [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        Eigen::FFT<double> fft;
        fft.SetFlag(Eigen::FFT<double>::Unscaled);
        std::vector<Complex> spectrum(static_cast<std::size_t>(width));
        std::vector<Complex> values;
        for (std::ptrdiff_t j = first; j < last; ++j) {
            for (int channel = 0; channel < 3; ++channel) {
                // The real part of sum_m (C - i S) e^(i m p), p = -azimuth, azimuth = 2 pi (i + 1/2) / W - pi.
                std::fill(spectrum.begin(), spectrum.end(), Complex());
                for (int m = 0; m <= order; ++m) {
                    spectrum[std::size_t(m)] = std::polar(1.0, m * (pi / width - pi)) *
                                               Complex(spectra.cosine(m, channel)[j], spectra.sine(m, channel)[j]);
                }
                fft.inv(values, spectrum);
                for (int i = 0; i < width; ++i) map.at(i, int(j), channel) = float(values[std::size_t(i)].real());
            }
        }
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
