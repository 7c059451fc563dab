#include "matte/PlaneTransform.h"

#include <Eigen/Dense>

namespace virga::matte::alignment {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;

Matrix3d matrixOf(const PlaneTransform& transform)
{
    const auto& m = transform.m;
    Matrix3d result;
    result << m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8];
    return result;
}

PlaneTransform transformOf(const Matrix3d& matrix)
{
    PlaneTransform result;
    for (int i = 0; i < 9; ++i) result.m[std::size_t(i)] = matrix(i / 3, i % 3);
    return result;
}

Vector2d vectorOf(Point point) { return {point.x, point.y}; }

}  // namespace

PlaneTransform PlaneTransform::operator*(const PlaneTransform& other) const
{
    return transformOf(matrixOf(*this) * matrixOf(other));
}

PlaneTransform PlaneTransform::inverse() const { return transformOf(matrixOf(*this).inverse()); }

double PlaneTransform::determinant() const { return matrixOf(*this).determinant(); }

bool PlaneTransform::isFinite() const
{
    return std::all_of(m.begin(), m.end(), [](double value) { return std::isfinite(value); });
}

PlaneTransform PlaneTransform::dividedBy(double scale) const
{
    PlaneTransform result = *this;
    for (double& value : result.m) value /= scale;
    return result;
}

std::optional<PlaneTransform> homographyOf(std::span<const Match> matches, std::span<const std::size_t> which)
{
    Eigen::Matrix<double, 9, 9> squares = Eigen::Matrix<double, 9, 9>::Zero();
    for (const std::size_t i : which) {
        const auto& [p, q] = matches[i];
        Eigen::Matrix<double, 2, 9> rows;
        rows << p.x, p.y, 1, 0, 0, 0, -q.x * p.x, -q.x * p.y, -q.x,  //
            0, 0, 0, p.x, p.y, 1, -q.y * p.x, -q.y * p.y, -q.y;
        squares += rows.transpose() * rows;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> solver(squares);
    const Eigen::Matrix<double, 9, 1> h = solver.eigenvectors().col(0);
    const PlaneTransform result{{h(0), h(1), h(2), h(3), h(4), h(5), h(6), h(7), h(8)}};
    if (!result.isFinite() || std::abs(h(8)) < 1e-3) return std::nullopt;
    return result.dividedBy(h(8));
}

std::optional<PlaneTransform> similarityOf(std::span<const Match> matches, std::span<const std::size_t> which)
{
    Vector2d from = Vector2d::Zero(), to = Vector2d::Zero();
    for (const std::size_t i : which) from += vectorOf(matches[i].from), to += vectorOf(matches[i].to);
    from /= double(which.size());
    to /= double(which.size());
    double cosine = 0, sine = 0, squares = 0;
    for (const std::size_t i : which) {
        const Vector2d p = vectorOf(matches[i].from) - from, q = vectorOf(matches[i].to) - to;
        cosine += p.dot(q);
        sine += p.x() * q.y() - p.y() * q.x();
        squares += p.squaredNorm();
    }
    if (!(squares > 1e-6)) return std::nullopt;
    const double c = cosine / squares, s = sine / squares;
    return PlaneTransform{
        {c, -s, to.x() - c * from.x() + s * from.y(), s, c, to.y() - s * from.x() - c * from.y(), 0, 0, 1}};
}

bool isPlausible(const PlaneTransform& transform)
{
    const auto& m = transform.m;
    for (int corner = 0; corner < 4; ++corner) {
        const double u = corner % 2 ? 1 : -1, v = corner / 2 ? 1 : -1;
        const double w = m[6] * u + m[7] * v + m[8];
        if (!(w > 0.5 * m[8])) return false;
        if (!(std::sqrt(squaredDistance(transform(u, v), {u, v})) < 4)) return false;
    }
    const double area = (m[0] * m[4] - m[3] * m[1]) / (m[8] * m[8]);
    return area > 0.25 && area < 4;
}

double overlapOf(const PlaneTransform& frame, const Grid& grid)
{
    const double u = grid.centreX / grid.scale, v = grid.centreY / grid.scale;
    int inside = 0;
    for (int y = 0; y < 16; ++y) {
        for (int x = 0; x < 16; ++x) {
            const Point at = frame(u * ((x + 0.5) / 8 - 1), v * ((y + 0.5) / 8 - 1));
            inside += std::abs(at.x) <= u && std::abs(at.y) <= v;
        }
    }
    return inside / 256.0;
}

}  // namespace virga::matte::alignment
