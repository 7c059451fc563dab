#include "depth/Geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/Error.h"
#include "core/Parallel.h"

namespace virga::depth {
namespace {

constexpr double kSameSurface = 0.03;  // neighbours whose inverse depths differ by less share a surface

double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vector minus(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

Vector cross(const Vector& a, const Vector& b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

class Pinhole {
public:
    explicit Pinhole(const Lens& lens) : lens_(lens) {}

    /// The point at depth 1 that pixel (x, y) sees.
    Vector ray(int x, int y) const
    {
        return {(x + 0.5 - lens_.axisX_px) / lens_.focal_px, -(y + 0.5 - lens_.axisY_px) / lens_.focal_px, -1};
    }
    Vector point(int x, int y, double depth) const
    {
        const Vector r = ray(x, y);
        return {r[0] * depth, r[1] * depth, r[2] * depth};
    }

private:
    Lens lens_;
};

Vector unit(const Vector& up)
{
    const double length = std::sqrt(dot(up, up));
    if (!(length > 0) || !std::isfinite(length))
        throw Error(ErrorCode::InvalidArgument, "the up direction ({}, {}, {}) has no direction", up[0], up[1], up[2]);
    return {up[0] / length, up[1] / length, up[2] / length};
}

}  // namespace

Lens centredLens(int width, int height, double horizontalFov)
{
    if (width < 1 || height < 1)
        throw Error(ErrorCode::InvalidArgument, "a picture of {}x{} has no pixels", width, height);
    if (!(horizontalFov > 0 && horizontalFov < std::numbers::pi))
        throw Error(ErrorCode::InvalidArgument, "a horizontal field of view of {} degrees is not between 0 and 180",
                    horizontalFov * 180 / std::numbers::pi);
    return {0.5 * width / std::tan(0.5 * horizontalFov), 0.5 * width, 0.5 * height};
}

Vector upInCamera(double pitch) noexcept { return {0, std::cos(pitch), std::sin(pitch)}; }

ImageF groundDepth(int width, int height, double horizontalFov, double cameraHeight, const Vector& up)
{
    return groundDepth(width, height, centredLens(width, height, horizontalFov), cameraHeight, up);
}

ImageF groundDepth(int width, int height, const Lens& lens, double cameraHeight, const Vector& up)
{
    const Pinhole camera(lens);
    if (!(cameraHeight > 0) || !std::isfinite(cameraHeight))
        throw Error(ErrorCode::InvalidArgument, "a camera height of {} m is not above 0", cameraHeight);
    const Vector normal = unit(up);
    ImageF depth(width, height, 1);
    parallelFor(0, height, 16, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y)
            for (int x = 0; x < width; ++x) {
                // A step of depth 1 along the ray sinks by -ray . up; the ground is cameraHeight down.
                const double sink = -dot(camera.ray(x, y), normal);
                depth.at(x, y) = sink > 0 ? float(cameraHeight / sink) : std::numeric_limits<float>::infinity();
            }
    });
    return depth;
}

ImageF groundDepth(int width, int height, double horizontalFov, double cameraHeight, double pitch)
{
    return groundDepth(width, height, horizontalFov, cameraHeight, upInCamera(pitch));
}

ImageF upFacing(ConstImageViewF metres, double horizontalFov, const Vector& up, int reach)
{
    const int W = metres.width(), H = metres.height();
    const Pinhole camera(centredLens(W, H, horizontalFov));
    const Vector normalUp = unit(up);
    if (reach < 1) throw Error(ErrorCode::InvalidArgument, "a reach of {} pixels is not at least 1", reach);
    ImageF facing(W, H, 1, 0.0f);
    parallelFor(0, H, 16, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y)
            for (int x = 0; x < W; ++x) {
                const double depth = metres.at(x, y);
                if (!std::isfinite(depth)) continue;
                const Vector here = camera.point(x, y, depth);
                // Between the neighbours on both sides where both are on this surface, else from here to the nearer.
                const auto difference = [&](int dx, int dy, Vector& out) {
                    Vector side[2] = {here, here};
                    double apart[2];
                    for (const int k : {0, 1}) {
                        const int nx = x + (k ? dx : -dx), ny = y + (k ? dy : -dy);
                        apart[k] = std::numeric_limits<double>::infinity();
                        if (nx < 0 || ny < 0 || nx >= W || ny >= H || !std::isfinite(metres.at(nx, ny))) continue;
                        apart[k] = std::abs(depth / metres.at(nx, ny) - 1);
                        side[k] = camera.point(nx, ny, metres.at(nx, ny));
                    }
                    if (std::max(apart[0], apart[1]) < kSameSurface)
                        out = minus(side[1], side[0]);
                    else if (std::isinf(std::min(apart[0], apart[1])))
                        return false;
                    else
                        out = apart[1] < apart[0] ? minus(side[1], here) : minus(here, side[0]);
                    return true;
                };
                Vector right, down;
                if (!difference(reach, 0, right) || !difference(0, reach, down)) continue;
                Vector normal = cross(down, right);
                const double length = std::sqrt(dot(normal, normal));
                if (!(length > 0)) continue;
                // Towards the camera, which is at the origin.
                const double sign = dot(normal, here) < 0 ? 1 : -1;
                facing.at(x, y) = float(std::clamp(sign * dot(normal, normalUp) / length, 0.0, 1.0));
            }
    });
    return facing;
}

}  // namespace virga::depth
