#include "sh/RowTransform.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <numbers>
#include <unsupported/Eigen/FFT>

namespace virga::sh {
namespace {

constexpr double pi = std::numbers::pi;
using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using ConstTable = Eigen::Map<const MatrixXd>;

/// Orders of one parity up to `order`.
Index countOf(int order, int parity) { return (order - parity + 2) / 2; }

}  // namespace

// Column i sits at azimuth a - pi, a = 2 pi (i + 1/2) / width, and p = -azimuth: cos(m p) = (-1)^m cos(m a),
// sin(m p) = -(-1)^m sin(m a).
RowTransform::RowTransform(int order, int width) : order_(order), width_(width)
{
    if (order > foldedOrder || width % 4 != 0) return;
    quarter_ = width / 4;
    for (int parity = 0; parity < 2; ++parity) {
        const double sign = parity == 0 ? 1.0 : -1.0;
        for (int i = 0; i < quarter_; ++i) {
            for (int m = parity; m <= order; m += 2) {
                // Whole parts of the circle are taken off before the angle is rounded.
                const double angle = pi / width * double(std::int64_t(m) * (2 * i + 1) % (2 * std::int64_t(width)));
                cosine_[parity].push_back(sign * std::cos(angle));
                sine_[parity].push_back(-sign * std::sin(angle));
            }
        }
    }
}

RowTransform::Sums RowTransform::forward(ConstImageViewF map, int firstRow, int rows) const
{
    if (!isFolded()) return forwardByFft(map, firstRow, rows);
    const Index vectors = Index(rows) * channels;
    const int stride = map.channels();
    MatrixXd cosineEven(quarter_, vectors), cosineOdd(quarter_, vectors);
    MatrixXd sineEven(quarter_, vectors), sineOdd(quarter_, vectors);
    for (int row = 0; row < rows; ++row) {
        const float* pixels = map.row(firstRow + row);
        for (int channel = 0; channel < channels; ++channel) {
            const Index v = Index(row) * channels + channel;
            const auto at = [pixels, stride, channel](int i) {
                return double(pixels[std::ptrdiff_t(i) * stride + channel]);
            };
            double *ce = &cosineEven(0, v), *co = &cosineOdd(0, v), *se = &sineEven(0, v), *so = &sineOdd(0, v);
            for (int i = 0; i < quarter_; ++i) {
                const double a = at(i), b = at(2 * quarter_ - 1 - i), c = at(2 * quarter_ + i), d = at(width_ - 1 - i);
                ce[i] = (a + d) + (b + c);
                co[i] = (a + d) - (b + c);
                se[i] = (a - d) - (b - c);
                so[i] = (a - d) + (b - c);
            }
        }
    }
    Sums sums(order_, rows);
    const auto spread = [&](std::vector<double>& to, int parity, const std::vector<double>& table,
                            const MatrixXd& folded) {
        const MatrixXd product = ConstTable(table.data(), countOf(order_, parity), quarter_) * folded;
        Eigen::Map<MatrixXd> all(to.data(), order_ + 1, vectors);
        for (Index k = 0; k < product.rows(); ++k) all.row(2 * k + parity) = product.row(k);
    };
    spread(sums.cosine, 0, cosine_[0], cosineEven);
    spread(sums.cosine, 1, cosine_[1], cosineOdd);
    spread(sums.sine, 0, sine_[0], sineEven);
    spread(sums.sine, 1, sine_[1], sineOdd);
    return sums;
}

void RowTransform::backward(const Sums& sums, ImageView<float> map, int firstRow, int rows) const
{
    if (!isFolded()) return backwardByFft(sums, map, firstRow, rows);
    const Index vectors = Index(rows) * channels;
    const auto gather = [&](const std::vector<double>& from, int parity, const std::vector<double>& table) {
        const ConstTable all(from.data(), order_ + 1, vectors);
        MatrixXd picked(countOf(order_, parity), vectors);
        for (Index k = 0; k < picked.rows(); ++k) picked.row(k) = all.row(2 * k + parity);
        return MatrixXd(ConstTable(table.data(), picked.rows(), quarter_).transpose() * picked);
    };
    const MatrixXd cosineEven = gather(sums.cosine, 0, cosine_[0]), cosineOdd = gather(sums.cosine, 1, cosine_[1]);
    const MatrixXd sineEven = gather(sums.sine, 0, sine_[0]), sineOdd = gather(sums.sine, 1, sine_[1]);
    const int stride = map.channels();
    for (int row = 0; row < rows; ++row) {
        float* pixels = map.row(firstRow + row);
        for (int channel = 0; channel < channels; ++channel) {
            const Index v = Index(row) * channels + channel;
            const auto at = [pixels, stride, channel](int i) -> float& {
                return pixels[std::ptrdiff_t(i) * stride + channel];
            };
            for (int i = 0; i < quarter_; ++i) {
                const double ce = cosineEven(i, v), co = cosineOdd(i, v), se = sineEven(i, v), so = sineOdd(i, v);
                at(i) = float((ce + co) + (se + so));
                at(width_ - 1 - i) = float((ce + co) - (se + so));
                at(2 * quarter_ - 1 - i) = float((ce - co) - (se - so));
                at(2 * quarter_ + i) = float((ce - co) + (se - so));
            }
        }
    }
}

RowTransform::Sums RowTransform::forwardByFft(ConstImageViewF map, int firstRow, int rows) const
{
    Sums sums(order_, rows);
    Eigen::FFT<double> fft;
    std::vector<double> samples(static_cast<std::size_t>(width_));
    std::vector<Complex> spectrum;
    for (int row = 0; row < rows; ++row) {
        const float* pixels = map.row(firstRow + row);
        for (int channel = 0; channel < channels; ++channel) {
            for (int i = 0; i < width_; ++i) samples[std::size_t(i)] = pixels[i * map.channels() + channel];
            if (width_ == 1) {
                spectrum.assign(1, samples[0]);  // kissfft knows no transform of one sample
            } else {
                fft.fwd(spectrum, samples);
            }
            for (int m = 0; m <= order_; ++m) {
                const Complex sum =
                    std::polar(1.0, m * (pi - pi / width_)) * spectrum[std::size_t(m) % spectrum.size()];
                sums.cosine[sums.at(m, row, channel)] = sum.real();
                sums.sine[sums.at(m, row, channel)] = sum.imag();
            }
        }
    }
    return sums;
}

void RowTransform::backwardByFft(const Sums& sums, ImageView<float> map, int firstRow, int rows) const
{
    Eigen::FFT<double> fft;
    fft.SetFlag(Eigen::FFT<double>::Unscaled);
    std::vector<Complex> spectrum(static_cast<std::size_t>(width_)), values;
    for (int row = 0; row < rows; ++row) {
        for (int channel = 0; channel < channels; ++channel) {
            // The real part of sum_m (C - i S) e^(i m p).
            std::fill(spectrum.begin(), spectrum.end(), Complex());
            for (int m = 0; m <= order_; ++m) {
                spectrum[std::size_t(m)] =
                    std::polar(1.0, m * (pi / width_ - pi)) *
                    Complex(sums.cosine[sums.at(m, row, channel)], sums.sine[sums.at(m, row, channel)]);
            }
            fft.inv(values, spectrum);
            for (int i = 0; i < width_; ++i) map.at(i, firstRow + row, channel) = float(values[std::size_t(i)].real());
        }
    }
}

}  // namespace virga::sh
