// Projection of panoramas onto spherical harmonics, beside what it replaces.
//   bench_harmonics [--size WIDTHxHEIGHT] [--order N] [--runs N]
// Prints a line a method: least and median time, and what it makes of a constant map of 1. All run in turn in one
// process, so that a busy machine is busy for each. `per pixel` is the straightforward way: all Y_lm of every pixel's
// direction by recurrence, times the pixel's value and solid angle, summed in double precision over all cores; `float`
// as google/spherical-harmonics sums, in single precision.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <glm/matrix.hpp>
#include <mutex>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include "core/Parallel.h"
#include "core/Timer.h"
#include "sh/Harmonics.h"
#include "sh/Panorama.h"
#include "sh/Rotation.h"

namespace {

using namespace virga;
using std::numbers::pi;

/// Real harmonics of one direction: as sh::basis, but with the recurrence's constants worked out once, without
/// allocation, and the azimuth's cosines and sines handed in. A fair opponent.
template <class Real>
class PixelBasis {
public:
    explicit PixelBasis(int order) : order_(order), y_(sh::coefficientCount(order))
    {
        double square = 1.0 / (4.0 * pi);
        for (int m = 0; m <= order; ++m) {
            if (m > 0) square *= (2.0 * m + 1.0) / (2.0 * m);
            seed_.push_back(Real(std::sqrt(square)));
            for (int l = m + 1; l <= order; ++l) {
                a_.push_back(Real(std::sqrt((4.0 * l * l - 1.0) / (double(l) * l - double(m) * m))));
                b_.push_back(
                    Real(std::sqrt((double(l - 1) * (l - 1) - double(m) * m) / (4.0 * double(l - 1) * (l - 1) - 1.0))));
            }
        }
    }
    const std::vector<Real>& at(Real sine, Real cosine, const Real* cosines, const Real* sines)
    {
        std::size_t step = 0;
        Real power = 1;
        for (int m = 0; m <= order_; ++m, power *= sine) {
            const Real real = m == 0 ? Real(1) : Real(std::numbers::sqrt2) * cosines[m];
            const Real imaginary = Real(std::numbers::sqrt2) * sines[m];
            Real before = 0, here = seed_[std::size_t(m)] * power;
            for (int l = m; l <= order_; ++l) {
                if (l > m) {
                    const Real next = a_[step] * (cosine * here - b_[step] * before);
                    ++step;
                    before = here;
                    here = next;
                }
                y_[sh::coefficientIndex(l, m)] = here * real;
                if (m > 0) y_[sh::coefficientIndex(l, -m)] = here * imaginary;
            }
        }
        return y_;
    }

private:
    int order_;
    std::vector<Real> seed_, a_, b_, y_;
};

template <class Real>
sh::Harmonics projectPerPixel(ConstImageViewF map, int order)
{
    const std::size_t count = sh::coefficientCount(order), orders = std::size_t(order) + 1;
    std::vector<Real> cosines(orders * std::size_t(map.width())), sines(cosines.size());
    for (int x = 0; x < map.width(); ++x) {
        const double azimuth = ((x + 0.5) / map.width() - 0.5) * 2 * pi;
        for (std::size_t m = 0; m < orders; ++m) {
            cosines[std::size_t(x) * orders + m] = Real(std::cos(-double(m) * azimuth));
            sines[std::size_t(x) * orders + m] = Real(std::sin(-double(m) * azimuth));
        }
    }
    sh::Harmonics result(order);
    std::mutex lock;
    parallelFor(0, map.height(), std::max(1, map.height() / 16), [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        PixelBasis<Real> basis(order);
        std::vector<Real> sum[3];
        for (auto& s : sum) s.assign(count, Real(0));
        for (int y = int(first); y < int(last); ++y) {
            const double t = (y + 0.5) / map.height() * pi;
            const double angle = std::cos(pi * y / map.height()) - std::cos(pi * (y + 1) / map.height());
            const Real area = Real(2 * pi / map.width() * angle);
            for (int x = 0; x < map.width(); ++x) {
                const auto& values = basis.at(Real(std::sin(t)), Real(std::cos(t)), &cosines[std::size_t(x) * orders],
                                              &sines[std::size_t(x) * orders]);
                const float* p = map.pixel(x, y);
                for (int c = 0; c < 3; ++c) {
                    const Real value = area * Real(p[c]);
                    Real* s = sum[c].data();
                    for (std::size_t i = 0; i < count; ++i) s[i] += value * values[i];
                }
            }
        }
        const std::lock_guard guard(lock);
        for (std::size_t i = 0; i < count; ++i) {
            result.coefficient[i] += glm::dvec3(sum[0][i], sum[1][i], sum[2][i]);
        }
    });
    return result;
}

/// How far the coefficients are from a constant's.
double constantError(const sh::Harmonics& h)
{
    double largest = std::abs(h.coefficient[0].r / std::sqrt(4 * pi) - 1.0);
    for (std::size_t i = 1; i < h.coefficient.size(); ++i) largest = std::max(largest, std::abs(h.coefficient[i].r));
    return largest;
}

}  // namespace

int main(int argc, char** argv)
{
    int width = 4096, height = 2048, order = 16, runs = 3;
    for (int i = 1; i + 1 < argc; i += 2) {
        const std::string flag = argv[i];
        if (flag == "--size" && std::sscanf(argv[i + 1], "%dx%d", &width, &height) != 2) return 2;
        if (flag == "--order") order = std::atoi(argv[i + 1]);
        if (flag == "--runs") runs = std::max(1, std::atoi(argv[i + 1]));
    }
    const ImageF constant(width, height, 3, 1.0f);
    std::printf("%d x %d RGB float, order %d, %u threads\n", width, height, order, std::thread::hardware_concurrency());
    struct Method {
        const char* name;
        std::function<sh::Harmonics()> project;
        std::vector<double> ms = {};
        double error = 0;
    };
    std::vector<Method> methods{
        {"separable, samples", [&] { return sh::projectPanorama(constant, order); }},
        {"separable, means over pixels", [&] { return sh::projectPanorama(constant, order, sh::PixelValue::Mean); }},
        {"per pixel, double", [&] { return projectPerPixel<double>(constant, order); }},
        {"per pixel, float", [&] { return projectPerPixel<float>(constant, order); }},
    };
    for (int run = 0; run < runs; ++run) {
        for (Method& method : methods) {
            Timer timer;
            const sh::Harmonics h = method.project();
            method.ms.push_back(timer.milliseconds());
            method.error = constantError(h);
        }
    }
    for (Method& method : methods) {
        std::sort(method.ms.begin(), method.ms.end());
        std::printf("%-30s %9.1f ms least %9.1f ms median   a constant map is off by %.1e\n", method.name,
                    method.ms.front(), method.ms[method.ms.size() / 2], method.error);
    }
    sh::Harmonics h(order);
    for (std::size_t i = 0; i < h.coefficient.size(); ++i) h.coefficient[i] = glm::dvec3(std::sin(double(i)));
    const glm::dmat3 quarter{{0, 0, -1}, {0, 1, 0}, {1, 0, 0}};
    Timer timer;
    for (int i = 0; i < 20; ++i) h = sh::rotated(h, quarter);
    std::printf("%-30s %9.3f ms\n", "rotation of these harmonics", timer.milliseconds() / 20);
    return 0;
}
