#include "matte/RainEquation.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/Parallel.h"
#include "matte/BoundedLines.h"

namespace virga::matte {
namespace {

/// Keeps the solve bounded where neither the data nor the cost sees alpha. Far below a bit of 16 in (C - S)^2.
constexpr double ridge = 1e-12;

constexpr int mostSteps = 500;

/// What the data say about alpha: sum over channels of (C - S)^2, the same for all frames.
std::vector<double> visibility(const ImageF& scene, const RainTerms& terms)
{
    const int channels = scene.channels();
    std::vector<double> seen(scene.size() / std::size_t(channels));
    for (std::size_t i = 0; i < seen.size(); ++i)
        for (int j = 0; j < channels; ++j) {
            const double gap = double(terms.color[j]) - scene.data()[i * channels + j];
            seen[i] += gap * gap;
        }
    return seen;
}

/// What the data ask of alpha at a pixel of a frame: the sum over channels of (C - S) (I - S).
double pull(const float* pixel, const float* scene, int channels, const RainTerms& terms)
{
    double sum = 0.0;
    for (int j = 0; j < channels; ++j) sum += (double(terms.color[j]) - scene[j]) * (double(pixel[j]) - scene[j]);
    return sum;
}

// ---------------------------------------------------------------------------------------------------------------------
// The matrix of sum (sin dx + cos dy)^2, entry by entry. A column goes along the rain as far as the grid allows: down
// the picture, or, beyond 45 degrees, across it; the formulas are the same with the axes swapped.

struct AlongRain {
    int columns, rows;
    std::ptrdiff_t toColumn, toRow;  // steps in a picture of one channel
    double s, c;                     // of D0: across the columns, down them

    AlongRain(int width, int height, double slant)
        : columns(width), rows(height), toColumn(1), toRow(width), s(std::sin(slant)), c(std::cos(slant))
    {
        if (std::abs(s) > std::abs(c)) {
            std::swap(columns, rows);
            std::swap(toColumn, toRow);
            std::swap(s, c);
        }
    }

    std::ptrdiff_t at(int x, int y) const { return x * toColumn + y * toRow; }

    double diagonal(int x, int y) const
    {
        const double here = (x + 1 < columns ? s : 0.0) + (y + 1 < rows ? c : 0.0);
        return here * here + (x > 0 ? s * s : 0.0) + (y > 0 ? c * c : 0.0);
    }
    /// Between (x, y) and (x + 1, y), which is inside.
    double right(int y) const { return -s * (s + (y + 1 < rows ? c : 0.0)); }
    /// Between (x, y) and (x, y + 1), which is inside.
    double down(int x) const { return -c * ((x + 1 < columns ? s : 0.0) + c); }
    /// Between (x + 1, y) and (x, y + 1).
    double cross() const { return s * c; }

    /// What the columns beside x add to the product at (x, y).
    double beside(const double* v, int x, int y) const
    {
        const double* here = v + at(x, y);
        double sum = 0.0;
        if (x + 1 < columns) {
            sum += right(y) * here[toColumn];
            if (y > 0) sum += cross() * here[toColumn - toRow];
        }
        if (x > 0) {
            sum += right(y) * here[-toColumn];
            if (y + 1 < rows) sum += cross() * here[toRow - toColumn];
        }
        return sum;
    }
    double product(const double* v, int x, int y) const
    {
        const double* here = v + at(x, y);
        double sum = diagonal(x, y) * here[0] + beside(v, x, y);
        if (y + 1 < rows) sum += down(x) * here[toRow];
        if (y > 0) sum += down(x) * here[-toRow];
        return sum;
    }
};

/// The equation for one frame's alpha.
class AlphaEquation {
public:
    AlphaEquation(const Footage& footage, std::size_t k, const ImageF& scene, std::vector<double> seen,
                  const RainTerms& terms)
        : matrix_(scene.width(), scene.height(), terms.slant), seen_(std::move(seen)), mu_(terms.mu),
          right_(seen_.size())
    {
        const int channels = scene.channels();
        for (std::size_t i = 0; i < right_.size(); ++i) {
            const double trust = footage.trusted(k, i);
            seen_[i] *= trust;
            right_[i] =
                trust * pull(footage.frames[k].data() + i * channels, scene.data() + i * channels, channels, terms) -
                terms.eta * footage.costing(k, i);
        }
    }

    /// Conjugate gradients, with the columns alone as preconditioner.
    void solve(ImageF& alpha, double tolerance)
    {
        const std::size_t n = right_.size();
        std::vector<double> x(alpha.data(), alpha.data() + n), residual(n), z(n), direction(n), image(n);
        multiply(x, image);
        double scale = 0.0;
        for (std::size_t i = 0; i < n; ++i) {
            residual[i] = right_[i] - image[i];
            scale += right_[i] * right_[i];
        }
        columns(residual, z);
        direction = z;
        double rz = dot(residual, z);
        for (int step = 0; step < mostSteps && dot(residual, residual) > tolerance * tolerance * scale; ++step) {
            multiply(direction, image);
            const double curvature = dot(direction, image);
            if (!(curvature > 0.0)) break;
            const double length = rz / curvature;
            for (std::size_t i = 0; i < n; ++i) {
                x[i] += length * direction[i];
                residual[i] -= length * image[i];
            }
            columns(residual, z);
            const double next = dot(residual, z);
            for (std::size_t i = 0; i < n; ++i) direction[i] = z[i] + next / rz * direction[i];
            rz = next;
        }
        for (std::size_t i = 0; i < n; ++i) alpha.data()[i] = float(x[i]);
    }

    /// Even columns, odd columns, each exactly with its neighbours held, until nothing moves.
    void solveBounded(ImageF& alpha, double tolerance)
    {
        std::vector<double> x(right_.size());
        for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::clamp(double(alpha.data()[i]), 0.0, 1.0);
        LineBlock block(matrix_.rows);
        for (int step = 0; step < mostSteps; ++step) {
            double moved = 0.0;
            for (int first = 0; first < 2; ++first) {
                for (int column = first; column < matrix_.columns; column += 2 * LineBlock::lanes) {
                    fillColumns(block, column, 2, [&](int cx, int cy, std::size_t i) {
                        return right_[i] - mu_ * matrix_.beside(x.data(), cx, cy);
                    });
                    forColumns(column, 2, [&](int l, int, int y, std::size_t i) { block.value[y][l] = x[i]; });
                    solveLines(block, 0.0, 1.0);
                    forColumns(column, 2, [&](int l, int, int y, std::size_t i) {
                        moved = std::max(moved, std::abs(block.value[y][l] - x[i]));
                        x[i] = block.value[y][l];
                    });
                }
            }
            if (moved <= tolerance || matrix_.s == 0.0) break;
        }
        for (std::size_t i = 0; i < x.size(); ++i) alpha.data()[i] = float(x[i]);
    }

private:
    static double dot(const std::vector<double>& a, const std::vector<double>& b)
    {
        double sum = 0.0;
        for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
        return sum;
    }

    void multiply(const std::vector<double>& v, std::vector<double>& to) const
    {
        for (int y = 0; y < matrix_.rows; ++y)
            for (int x = 0; x < matrix_.columns; ++x) {
                const auto i = std::size_t(matrix_.at(x, y));
                to[i] = (seen_[i] + ridge) * v[i] + mu_ * matrix_.product(v.data(), x, y);
            }
    }

    /// body(lane, x, y, pixel) for the columns first, first + step, ... that a block holds.
    template <class Body>
    void forColumns(int first, int step, Body&& body) const
    {
        for (int y = 0; y < matrix_.rows; ++y)
            for (int l = 0; l < LineBlock::lanes; ++l) {
                const int x = first + l * step;
                if (x < matrix_.columns) body(l, x, y, std::size_t(matrix_.at(x, y)));
            }
    }

    /// right(x, y, pixel): the right side there.
    template <class Right>
    void fillColumns(LineBlock& block, int first, int step, Right&& right) const
    {
        for (int y = 0; y < matrix_.rows; ++y) {
            block.diagonal[y].fill(1.0);
            block.link[y].fill(0.0);
            block.rightSide[y].fill(0.0);
            block.value[y].fill(0.0);
        }
        forColumns(first, step, [&](int l, int x, int y, std::size_t i) {
            block.diagonal[y][l] = seen_[i] + ridge + mu_ * matrix_.diagonal(x, y);
            block.link[y][l] = y + 1 < matrix_.rows ? mu_ * matrix_.down(x) : 0.0;
            block.rightSide[y][l] = right(x, y, i);
        });
    }

    void columns(const std::vector<double>& from, std::vector<double>& to)
    {
        LineBlock block(matrix_.rows);
        for (int first = 0; first < matrix_.columns; first += LineBlock::lanes) {
            fillColumns(block, first, 1, [&](int, int, std::size_t i) { return from[i]; });
            solveLines(block);
            forColumns(first, 1, [&](int l, int, int y, std::size_t i) { to[i] = block.value[y][l]; });
        }
    }

    AlongRain matrix_;
    std::vector<double> seen_;
    double mu_;
    std::vector<double> right_;
};

// ---------------------------------------------------------------------------------------------------------------------

double rainRoughness(const ImageF& alpha, const RainTerms& terms)
{
    const int width = alpha.width(), height = alpha.height();
    double sum = 0.0;
    const double s = std::sin(terms.slant), c = std::cos(terms.slant);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double here = alpha.at(x, y);
            const double along = (x + 1 < width ? s * (alpha.at(x + 1, y) - here) : 0.0) +
                                 (y + 1 < height ? c * (alpha.at(x, y + 1) - here) : 0.0);
            sum += along * along;
        }
    return sum;
}

}  // namespace

// ---------------------------------------------------------------------------------------------------------------------

RainObjective rainObjective(const Footage& footage, const ImageF& scene, std::span<const ImageF> alphas,
                            const RainTerms& terms)
{
    const std::span<const ImageF> frames = footage.frames;
    assert(frames.size() == alphas.size());
    const int channels = scene.channels();
    std::vector<RainObjective> parts(frames.size());
    parallelFor(0, std::ptrdiff_t(frames.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (std::ptrdiff_t k = first; k < last; ++k) {
            const ImageF &frame = frames[std::size_t(k)], &alpha = alphas[std::size_t(k)];
            RainObjective& part = parts[std::size_t(k)];
            for (std::size_t i = 0; i < alpha.size(); ++i) {
                const double a = alpha.data()[i], trust = footage.trusted(std::size_t(k), i);
                for (int j = 0; j < channels; ++j) {
                    const double e = frame.data()[i * channels + j] - (1.0 - a) * scene.data()[i * channels + j] -
                                     a * terms.color[j];
                    part.data += trust * e * e;
                }
                part.cost += 2.0 * terms.eta * footage.costing(std::size_t(k), i) * a;
            }
            part.rain = terms.mu * rainRoughness(alpha, terms);
        }
    });
    RainObjective sum;
    for (const RainObjective& part : parts) {
        sum.data += part.data;
        sum.rain += part.rain;
        sum.cost += part.cost;
    }
    for (int y = 0; y < scene.height(); ++y)
        for (int x = 0; x < scene.width(); ++x)
            for (int j = 0; j < channels; ++j) {
                const double here = scene.at(x, y, j);
                const double dx = x + 1 < scene.width() ? scene.at(x + 1, y, j) - here : 0.0;
                const double dy = y + 1 < scene.height() ? scene.at(x, y + 1, j) - here : 0.0;
                sum.scene += terms.lambda * (dx * dx + dy * dy);
            }
    return sum;
}

void solveScene(const Footage& footage, std::span<const ImageF> alphas, const RainTerms& terms, ImageF& scene,
                double tolerance)
{
    const std::span<const ImageF> frames = footage.frames;
    assert(frames.size() == alphas.size());
    const int width = scene.width(), height = scene.height(), channels = scene.channels();
    const std::size_t n = std::size_t(width) * std::size_t(height);
    std::vector<double> weight(n), right(n * std::size_t(channels));
    parallelFor(0, std::ptrdiff_t(n), 4096, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (std::size_t k = 0; k < frames.size(); ++k)
            for (std::ptrdiff_t i = first; i < last; ++i) {
                const double a = alphas[k].data()[i], through = 1.0 - a;
                const double trust = footage.trusted(k, std::size_t(i));
                weight[std::size_t(i)] += trust * through * through;
                for (int j = 0; j < channels; ++j)
                    right[std::size_t(i * channels + j)] +=
                        trust * through * (frames[k].data()[i * channels + j] - a * terms.color[j]);
            }
    });

    // One system a channel, all of the same matrix: diag(weight) + lambda * (5-point Laplacian).
    parallelFor(0, channels, 1, [&](std::ptrdiff_t firstChannel, std::ptrdiff_t lastChannel) {
        for (std::ptrdiff_t j = firstChannel; j < lastChannel; ++j) {
            const auto neighbours = [&](int x, int y) {
                return double(x > 0) + double(x + 1 < width) + double(y > 0) + double(y + 1 < height);
            };
            const auto multiply = [&](const std::vector<double>& v, std::vector<double>& to) {
                std::size_t i = 0;
                for (int y = 0; y < height; ++y)
                    for (int x = 0; x < width; ++x, ++i) {
                        double sum = neighbours(x, y) * v[i];
                        if (x > 0) sum -= v[i - 1];
                        if (x + 1 < width) sum -= v[i + 1];
                        if (y > 0) sum -= v[i - std::size_t(width)];
                        if (y + 1 < height) sum -= v[i + std::size_t(width)];
                        to[i] = weight[i] * v[i] + terms.lambda * sum;
                    }
            };
            std::vector<double> x(n), residual(n), z(n), direction(n), image(n), inverse(n);
            std::size_t i = 0;
            for (int y = 0; y < height; ++y)
                for (int px = 0; px < width; ++px, ++i) {
                    x[i] = scene.data()[i * channels + j];
                    const double diagonal = weight[i] + terms.lambda * neighbours(px, y);
                    inverse[i] = diagonal > 0.0 ? 1.0 / diagonal : 0.0;
                }
            multiply(x, image);
            double scale = 0.0, rz = 0.0;
            for (i = 0; i < n; ++i) {
                const double b = right[i * channels + j];
                residual[i] = b - image[i];
                scale += b * b;
                direction[i] = inverse[i] * residual[i];
                rz += residual[i] * direction[i];
            }
            for (int step = 0; step < mostSteps; ++step) {
                double left = 0.0;
                for (i = 0; i < n; ++i) left += residual[i] * residual[i];
                if (left <= tolerance * tolerance * scale) break;
                multiply(direction, image);
                double curvature = 0.0;
                for (i = 0; i < n; ++i) curvature += direction[i] * image[i];
                if (!(curvature > 0.0)) break;
                const double length = rz / curvature;
                double next = 0.0;
                for (i = 0; i < n; ++i) {
                    x[i] += length * direction[i];
                    residual[i] -= length * image[i];
                    z[i] = inverse[i] * residual[i];
                    next += residual[i] * z[i];
                }
                for (i = 0; i < n; ++i) direction[i] = z[i] + next / rz * direction[i];
                rz = next;
            }
            for (i = 0; i < n; ++i) scene.data()[i * channels + j] = float(x[i]);
        }
    });
}

void solveAlpha(const Footage& footage, const ImageF& scene, const RainTerms& terms, std::span<ImageF> alphas,
                double tolerance)
{
    const std::span<const ImageF> frames = footage.frames;
    assert(frames.size() == alphas.size());
    const std::vector<double> seen = visibility(scene, terms);
    parallelFor(0, std::ptrdiff_t(frames.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (std::ptrdiff_t k = first; k < last; ++k) {
            AlphaEquation equation(footage, std::size_t(k), scene, seen, terms);
            if (terms.bounded)
                equation.solveBounded(alphas[std::size_t(k)], tolerance);
            else
                equation.solve(alphas[std::size_t(k)], tolerance);
        }
    });
}

}  // namespace virga::matte
