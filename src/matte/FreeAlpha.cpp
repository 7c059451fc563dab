#include "matte/FreeAlpha.h"

#include <algorithm>

namespace virga::matte {
namespace {

double dot(const std::vector<double>& a, const std::vector<double>& b)
{
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
    return sum;
}

}  // namespace

FreeAlpha::FreeAlpha(const FrameData& data, int width, int height, const RainTerms& terms)
    : matrix_(width, height, terms.slant), mu_(terms.mu), seen_(std::size_t(width) * std::size_t(height)),
      right_(seen_.size())
{
    for (int y = 0; y < height; ++y)
        data.ask(y, seen_.data() + std::ptrdiff_t(y) * width, right_.data() + std::ptrdiff_t(y) * width);
}

void FreeAlpha::solve(ImageF& alpha, double tolerance)
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
    for (int step = 0; step < mostAlphaSteps && dot(residual, residual) > tolerance * tolerance * scale; ++step) {
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

void FreeAlpha::multiply(const std::vector<double>& v, std::vector<double>& to) const
{
    for (int y = 0; y < matrix_.rows; ++y)
        for (int x = 0; x < matrix_.columns; ++x) {
            const auto i = std::size_t(matrix_.at(x, y));
            to[i] = (seen_[i] + alphaRidge) * v[i] + mu_ * matrix_.product(v.data(), x, y);
        }
}

void FreeAlpha::columns(const std::vector<double>& from, std::vector<double>& to) const
{
    Block block(matrix_.rows);
    for (int first = 0; first < matrix_.columns; first += Block::lanes) {
        const int lanes = std::min(Block::lanes, matrix_.columns - first);
        block.coupling.fill(0.0);
        for (int l = 0; l < lanes; ++l) block.coupling[l] = mu_ * matrix_.coupling(first + l);
        for (int y = 0; y < matrix_.rows; ++y) {
            block.own[y].fill(1.0);
            block.pull[y].fill(0.0);
            for (int l = 0; l < lanes; ++l) {
                const auto i = std::size_t(matrix_.at(first + l, y));
                block.own[y][l] = seen_[i] + alphaRidge + mu_ * matrix_.own(first + l, y);
                block.pull[y][l] = from[i];
            }
        }
        solveLines(block);
        for (int y = 0; y < matrix_.rows; ++y)
            for (int l = 0; l < lanes; ++l) to[std::size_t(matrix_.at(first + l, y))] = block.value[y][l];
    }
}

}  // namespace virga::matte
