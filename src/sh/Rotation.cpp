#include "sh/Rotation.h"

#include <cmath>
#include <glm/matrix.hpp>
#include <numbers>
#include <vector>

#include "core/Parallel.h"

namespace virga::sh {
namespace {

/// Angles of Z(a) Y(b) Z(c), right-handed about the textbook's z and y.
struct EulerAngles {
    double a, b, c;

    /// m(row, column) in the textbook's axes. c is taken from what Z(-a) leaves over, so that a and c, each of which is
    /// ill-determined for b near 0 and pi, still compose to the rotation.
    explicit EulerAngles(const glm::dmat3& textbook)
    {
        const auto m = [&](int row, int column) { return textbook[column][row]; };
        const double sine = std::hypot(m(0, 2), m(1, 2));
        a = sine > 0.0 ? std::atan2(m(1, 2), m(0, 2)) : 0.0;
        b = std::atan2(sine, m(2, 2));
        const double ca = std::cos(a), sa = std::sin(a);
        c = std::atan2(ca * m(1, 0) - sa * m(0, 0), ca * m(1, 1) - sa * m(0, 1));
    }
};

/// Coefficients of one band: cosine[m] of cos(m p), m >= 0; sine[m] of sin(m p), m > 0 (sine[0] stays 0).
struct Band {
    std::vector<glm::dvec3> cosine, sine;

    explicit Band(int l) : cosine(std::size_t(l) + 1), sine(std::size_t(l) + 1) {}

    /// About the textbook's z: cos(m (p - angle)), sin(m (p - angle)).
    void turnAboutZ(double angle)
    {
        for (std::size_t m = 1; m < cosine.size(); ++m) {
            const double c = std::cos(double(m) * angle), s = std::sin(double(m) * angle);
            const glm::dvec3 even = c * cosine[m] - s * sine[m];
            sine[m] = s * cosine[m] + c * sine[m];
            cosine[m] = even;
        }
    }
};

/// The last rows, a = l, of d^l_ab(90 degrees) for all bands; b >= 0.
std::vector<std::vector<double>> lastRows(int order)
{
    std::vector<std::vector<double>> rows{{1.0}};
    for (int l = 1; l <= order; ++l) {
        const std::vector<double>& before = rows.back();
        std::vector<double> row(std::size_t(l) + 1);
        row[0] = -std::sqrt((2.0 * l - 1.0) / (2.0 * l)) * before[0];
        for (int b = 1; b <= l; ++b) {
            row[std::size_t(b)] =
                std::sqrt(0.5 * l * (2.0 * l - 1.0) / (double(l + b) * (l + b - 1))) * before[std::size_t(b) - 1];
        }
        rows.push_back(std::move(row));
    }
    return rows;
}

/// d^l_ab(90 degrees) for a, b >= 0; row a, column b. From the last row down each column to the diagonal, along which
/// the elements grow or oscillate, so that errors stay behind them; beyond it d_ba = (-1)^(a+b) d_ab.
std::vector<double> quarterTurn(int l, const std::vector<double>& lastRow)
{
    const std::size_t n = std::size_t(l) + 1;
    std::vector<double> d(n * n);
    for (int b = 0; b <= l; ++b) {
        double above = 0.0, here = lastRow[std::size_t(b)];
        for (int a = l; a >= b; --a) {
            d[std::size_t(a) * n + std::size_t(b)] = here;
            d[std::size_t(b) * n + std::size_t(a)] = (a + b) % 2 == 0 ? here : -here;
            if (a == b) break;
            // d_{a-1,b} from d_{a,b} and d_{a+1,b}.
            const double scale = 1.0 / std::sqrt(double(l - a + 1) * (l + a));
            const double next = scale * (2.0 * b * here - std::sqrt(double(l - a) * (l + a + 1)) * above);
            above = here;
            here = next;
        }
    }
    return d;
}

/// Y(90 degrees), or its inverse, on a band of real harmonics. For these, with d_{a,-b} = (-1)^(l+a) d_{ab},
///   cosine'[a] = sum over b with l + a + b even of 2 (-1)^(a+b) d_ab cosine[b],
///   sine'[a]   = sum over b with l + a + b odd  of 2 (-1)^(a+b) d_ab sine[b],
/// but for b = 0 and a = 0, which have 1 / sqrt(2) of that each.
void turnQuarter(int l, const std::vector<double>& d, bool isInverse, Band& band)
{
    const std::size_t n = std::size_t(l) + 1;
    Band result(l);
    const auto weight = [](std::size_t m) { return m == 0 ? 1.0 / std::numbers::sqrt2 : 1.0; };
    for (std::size_t a = 0; a < n; ++a) {
        glm::dvec3 cosine(0.0), sine(0.0);
        for (std::size_t b = 0; b < n; ++b) {
            const double element = isInverse ? d[b * n + a] : d[a * n + b];
            const double signedElement = (a + b) % 2 == 0 ? 2.0 * element : -2.0 * element;
            if ((std::size_t(l) + a + b) % 2 == 0) {
                cosine += weight(b) * signedElement * band.cosine[b];
            } else {
                sine += signedElement * band.sine[b];
            }
        }
        result.cosine[a] = weight(a) * cosine;
        if (a > 0) result.sine[a] = sine;
    }
    band = std::move(result);
}

}  // namespace

Harmonics rotated(const Harmonics& harmonics, const glm::dmat3& rotation)
{
    // (x', y', z') = (-z, -x, y), see Harmonics.h; columns of the matrix are where the textbook's axes lie in ours.
    const glm::dmat3 fromTextbook{{0, 0, -1}, {-1, 0, 0}, {0, 1, 0}};
    const EulerAngles angles(glm::transpose(fromTextbook) * rotation * fromTextbook);
    constexpr double quarter = 0.5 * std::numbers::pi;

    const std::vector<std::vector<double>> edges = lastRows(harmonics.order);
    Harmonics result(harmonics.order);
    parallelFor(0, harmonics.order + 1, 8, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int l = int(first); l < int(last); ++l) {
            Band band(l);
            for (int m = 0; m <= l; ++m) {
                band.cosine[std::size_t(m)] = harmonics.coefficient[coefficientIndex(l, m)];
                if (m > 0) band.sine[std::size_t(m)] = harmonics.coefficient[coefficientIndex(l, -m)];
            }
            const std::vector<double> d = quarterTurn(l, edges[std::size_t(l)]);
            band.turnAboutZ(angles.c + quarter);
            turnQuarter(l, d, false, band);
            band.turnAboutZ(angles.b);
            turnQuarter(l, d, true, band);
            band.turnAboutZ(angles.a - quarter);
            for (int m = 0; m <= l; ++m) {
                result.coefficient[coefficientIndex(l, m)] = band.cosine[std::size_t(m)];
                if (m > 0) result.coefficient[coefficientIndex(l, -m)] = band.sine[std::size_t(m)];
            }
        }
    });
    return result;
}

}  // namespace virga::sh
