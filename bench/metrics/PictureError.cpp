#include "PictureError.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <complex>
#include <numbers>

#include "Flip.h"

namespace bench {

using virga::ConstImageViewF;

double meanOf(ConstImageViewF picture)
{
    double sum = 0;
    for (int y = 0; y < picture.height(); ++y)
        for (int x = 0; x < picture.width(); ++x)
            for (int c = 0; c < 3; ++c) sum += double(picture.at(x, y, c));
    return sum / (3.0 * picture.width() * picture.height());
}

PictureError pictureError(ConstImageViewF picture, ConstImageViewF truth, double mean)
{
    assert(picture.width() == truth.width() && picture.height() == truth.height());
    PictureError error;
    for (int y = 0; y < truth.height(); ++y)
        for (int x = 0; x < truth.width(); ++x)
            for (int c = 0; c < 3; ++c) {
                const double off = double(picture.at(x, y, c)) - double(truth.at(x, y, c));
                error.rmse += off * off;
                error.most = std::max(error.most, std::abs(off) / mean);
            }
    error.rmse = std::sqrt(error.rmse / (3.0 * truth.width() * truth.height())) / mean;
    error.flip = meanFlip(picture, truth);
    return error;
}

std::vector<double> powerSpectrum(ConstImageViewF picture, int channel)
{
    using Complex = std::complex<double>;
    const int width = picture.width(), height = picture.height();
    const auto wave = [](int k, int n, int size) {
        return std::polar(1.0, -2 * std::numbers::pi * double((long(k) * n) % size) / size);
    };
    std::vector<Complex> rows(std::size_t(width) * std::size_t(height));
    for (int y = 0; y < height; ++y)
        for (int k = 0; k < width; ++k)
            for (int x = 0; x < width; ++x)
                rows[std::size_t(y * width + k)] += double(picture.at(x, y, channel)) * wave(k, x, width);
    const int shorter = std::min(width, height);
    std::vector<double> rings(std::size_t(shorter / 2), 0.0);
    const double count = double(width) * height;
    for (int k = 0; k < width; ++k)
        for (int j = 0; j < height; ++j) {
            if (k == 0 && j == 0) continue;
            Complex sum = 0;
            for (int y = 0; y < height; ++y) sum += rows[std::size_t(y * width + k)] * wave(j, y, height);
            const double fx = double(std::min(k, width - k)) / width, fy = double(std::min(j, height - j)) / height;
            const auto ring = std::size_t(std::hypot(fx, fy) * shorter);
            rings[std::min(ring, rings.size() - 1)] += std::norm(sum) / (count * count);
        }
    return rings;
}

}  // namespace bench
