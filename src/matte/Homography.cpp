#include "matte/Homography.h"

#include <Eigen/Dense>

namespace virga::matte {

std::array<double, 2> Homography::operator()(double x, double y) const
{
    const double w = m[6] * x + m[7] * y + m[8];
    return {(m[0] * x + m[1] * y + m[2]) / w, (m[3] * x + m[4] * y + m[5]) / w};
}

Homography Homography::inverse() const
{
    Eigen::Matrix3d matrix;
    matrix << m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8];
    Eigen::Matrix3d inverted = matrix.inverse();
    if (!inverted.allFinite()) return {};
    if (inverted(2, 2) > 0) inverted /= inverted(2, 2);
    Homography result;
    for (int i = 0; i < 9; ++i) result.m[std::size_t(i)] = inverted(i / 3, i % 3);
    return result;
}

}  // namespace virga::matte
