#include "bench/EffectStatistics.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace virga::bench {

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

Moments momentsOf(ConstImageViewF picture, int channel)
{
    const double count = double(picture.width()) * picture.height();
    Moments moments;
    for (int y = 0; y < picture.height(); ++y)
        for (int x = 0; x < picture.width(); ++x) moments.mean += double(picture.at(x, y, channel)) / count;
    double cubes = 0;
    for (int y = 0; y < picture.height(); ++y)
        for (int x = 0; x < picture.width(); ++x) {
            const double off = double(picture.at(x, y, channel)) - moments.mean;
            moments.variance += off * off / count;
            cubes += off * off * off / count;
        }
    if (moments.variance > 0) moments.skewness = cubes / std::pow(moments.variance, 1.5);
    return moments;
}

EffectComparison compareEffects(ConstImageViewF effect, ConstImageViewF truth)
{
    constexpr int green = 1;
    const Moments ours = momentsOf(effect, green), theirs = momentsOf(truth, green);
    EffectComparison found;
    found.skewness = ours.skewness;
    found.trueSkewness = theirs.skewness;
    const auto ratio = [](double a, double b) { return b != 0 ? a / b : 1; };
    found.mean = ratio(ours.mean, theirs.mean);
    found.variance = ratio(ours.variance, theirs.variance);
    const std::vector<double> rings = powerSpectrum(effect, green), trueRings = powerSpectrum(truth, green);
    double power[2] = {}, truePower[2] = {}, squares = 0;
    std::size_t compared = 0;
    for (std::size_t k = 0; k < rings.size(); ++k) {
        const std::size_t part = k < rings.size() / 4 ? 0 : 1;  // rings end at half a cycle a pixel
        power[part] += rings[k];
        truePower[part] += trueRings[k];
        if (rings[k] <= 0 || trueRings[k] <= 0) continue;
        squares += std::pow(10 * std::log10(rings[k] / trueRings[k]), 2);
        ++compared;
    }
    found.coarse = ratio(power[0], truePower[0]);
    found.fine = ratio(power[1], truePower[1]);
    if (compared > 0) found.spectrum_dB = std::sqrt(squares / double(compared));
    return found;
}

}  // namespace virga::bench
