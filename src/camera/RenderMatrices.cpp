#include "camera/RenderMatrices.h"

#include <cassert>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vec4.hpp>

#include "camera/TrackText.h"
#include "core/Error.h"

namespace virga::camera {
namespace {

/// For column vectors: the rows of a matrix for row vectors are its columns.
glm::dmat4 forColumns(const RowMatrix& rows)
{
    glm::dmat4 m;
    for (int c = 0; c < 4; ++c)
        for (int r = 0; r < 4; ++r) m[c][r] = rows[std::size_t(4 * c + r)];
    return m;
}

Pose poseFromWorldToCamera(const RowMatrix& rows, const std::string& place)
{
    glm::dmat4 cameraFromWorld = forColumns(rows);
    const bool looksAlongZ = glm::determinant(glm::dmat3(cameraFromWorld)) < 0;
    if (looksAlongZ)
        for (int c = 0; c < 4; ++c) cameraFromWorld[c][2] = -cameraFromWorld[c][2];
    // Checked as it stands: the inverse of a singular matrix would only say that it is not finite.
    const Pose inverse = poseFromMatrix(cameraFromWorld, place + ", worldToCamera");
    const double scale = std::cbrt(glm::determinant(glm::dmat3(cameraFromWorld)));
    Pose pose;
    pose.worldFromCamera = glm::transpose(inverse.worldFromCamera);
    pose.position = -(pose.worldFromCamera * inverse.position) / scale;
    return pose;
}

/// A perspective matrix taken apart as in Hartley & Zisserman 2004, 6.2: its rows x, y and w as planes through the
/// camera. w grows along the axis; what of x and y is across the axis are the picture's own axes.
Pose poseFromWorldToNdc(const RowMatrix& rows, const std::string& place)
{
    const std::string here = place + ", worldToNDC";
    const glm::dmat4 m = glm::transpose(forColumns(rows));  // m[i]: the plane of coordinate i
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
            if (!std::isfinite(m[i][j])) throw Error(ErrorCode::Input, "{}: the matrix is not finite", here);
    glm::dvec3 x(m[0]), y(m[1]), ahead(m[3]);
    const double depth = glm::length(ahead);
    if (!(depth > 1e-12 * (glm::length(x) + glm::length(y))))
        throw Error(ErrorCode::Input, "{}: the camera is orthographic", here);
    ahead /= depth;
    const glm::dvec2 middle(glm::dot(x, ahead) / depth, glm::dot(y, ahead) / depth);
    x = x / depth - middle.x * ahead;
    y = y / depth - middle.y * ahead;
    const double width = glm::length(x), height = glm::length(y);
    if (!(width > 1e-9 && height > 1e-9)) throw Error(ErrorCode::Input, "{}: the matrix is singular", here);
    const glm::dvec3 right = x / width, up = glm::cross(right, ahead);
    if (std::abs(glm::dot(right, y / height)) > 1e-3)
        throw Error(ErrorCode::Input, "{}: the picture's axes are not at right angles", here);
    const bool isDown = glm::dot(up, y) < 0;
    const glm::dvec2 expected(isDown ? 0.5 : 0.0);
    if (glm::length(middle - expected) > 0.25)
        throw Error(
            ErrorCode::Input,
            "{}: the axis meets the picture at ({:.3g}, {:.3g}): its world is left-handed, or the lens is shifted",
            here, middle.x, middle.y);
    Pose pose;
    pose.worldFromCamera = {right, up, -ahead};
    // Where all three planes meet.
    const glm::dmat3 planes{glm::dvec3(m[0]), glm::dvec3(m[1]), glm::dvec3(m[3])};
    pose.position = -(glm::inverse(glm::transpose(planes)) * glm::dvec3(m[0].w, m[1].w, m[3].w));
    for (int i = 0; i < 3; ++i)
        if (!std::isfinite(pose.position[i])) throw Error(ErrorCode::Input, "{}: the matrix is singular", here);
    pose.verticalFov = 2 * std::atan((isDown ? 0.5 : 1.0) / height);
    return pose;
}

}  // namespace

Pose poseFromRenderMatrices(const RenderMatrices& matrices, const std::string& place)
{
    assert(!matrices.empty());
    if (!matrices.worldToCamera) return poseFromWorldToNdc(*matrices.worldToNdc, place);
    Pose pose = poseFromWorldToCamera(*matrices.worldToCamera, place);
    if (matrices.worldToNdc) pose.verticalFov = poseFromWorldToNdc(*matrices.worldToNdc, place).verticalFov;
    return pose;
}

}  // namespace virga::camera
