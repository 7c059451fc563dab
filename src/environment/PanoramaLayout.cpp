#include "environment/PanoramaLayout.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <numbers>
#include <vector>

#include "core/Error.h"
#include "core/Parallel.h"
#include "sh/Panorama.h"

namespace virga::environment {
namespace {

constexpr double pi = std::numbers::pi;

bool isRatio(const ImageF& image, int across, int down)
{
    return image.width() % across == 0 && image.height() % down == 0 && image.width() / across == image.height() / down;
}

/// Where the faces +X -X +Y -Y +Z -Z lie, in faces from the top left.
struct Faces {
    std::array<std::array<int, 2>, 6> cell;
    bool lastIsUpsideDown = false;
};

Faces facesOf(PanoramaLayout layout)
{
    switch (layout) {
        case PanoramaLayout::HorizontalCross: return {{{{2, 1}, {0, 1}, {1, 0}, {1, 2}, {1, 1}, {3, 1}}}};
        case PanoramaLayout::VerticalCross: return {{{{2, 1}, {0, 1}, {1, 0}, {1, 2}, {1, 1}, {1, 3}}}, true};
        case PanoramaLayout::HorizontalStrip: return {{{{0, 0}, {1, 0}, {2, 0}, {3, 0}, {4, 0}, {5, 0}}}};
        default: return {{{{0, 0}, {0, 1}, {0, 2}, {0, 3}, {0, 4}, {0, 5}}}};
    }
}

/// A face and the place on it, 0 to 1 from its top left, of a direction in our axes.
struct OnCube {
    int face;
    double u, v;
};

OnCube onCube(const glm::dvec3& d)
{
    const double x = d.x, y = d.y, z = -d.z;  // left-handed, +z ahead
    const double ax = std::abs(x), ay = std::abs(y), az = std::abs(z);
    // OpenGL 4.6, table 8.19.
    if (ax >= ay && ax >= az)
        return x > 0 ? OnCube{0, 0.5 - 0.5 * z / ax, 0.5 - 0.5 * y / ax}
                     : OnCube{1, 0.5 + 0.5 * z / ax, 0.5 - 0.5 * y / ax};
    if (ay >= az)
        return y > 0 ? OnCube{2, 0.5 + 0.5 * x / ay, 0.5 + 0.5 * z / ay}
                     : OnCube{3, 0.5 + 0.5 * x / ay, 0.5 - 0.5 * z / ay};
    return z > 0 ? OnCube{4, 0.5 + 0.5 * x / az, 0.5 - 0.5 * y / az}
                 : OnCube{5, 0.5 - 0.5 * x / az, 0.5 - 0.5 * y / az};
}

/// The picture's place of a direction, in pixels, clamped to `margin` inside the face or disc.
glm::dvec2 placeOf(const glm::dvec3& d, PanoramaLayout layout, const ImageF& image, glm::dvec2& low, glm::dvec2& high)
{
    low = glm::dvec2(0.5);
    high = glm::dvec2(image.width() - 0.5, image.height() - 0.5);
    if (layout == PanoramaLayout::AngularMap || layout == PanoramaLayout::MirrorBall) {
        const double across = std::hypot(d.x, d.y);
        const double angle = std::atan2(across, -d.z);
        // From ahead in the middle to back at the rim; a ball's middle shows the camera, which is behind.
        const double radius =
            layout == PanoramaLayout::AngularMap ? angle / pi : std::sin(0.5 * std::atan2(across, d.z));
        const glm::dvec2 side = across > 0.0 ? glm::dvec2(d.x, -d.y) / across : glm::dvec2(1.0, 0.0);
        // The rim's last pixel is half background.
        const double size = 0.5 * image.width();
        return glm::dvec2(size) + side * std::min(radius * size, size - 1.0);
    }
    const Faces faces = facesOf(layout);
    OnCube at = onCube(d);
    if (at.face == 5 && faces.lastIsUpsideDown) at = {5, 1.0 - at.u, 1.0 - at.v};
    const bool isTall = layout == PanoramaLayout::VerticalCross || layout == PanoramaLayout::HorizontalCross;
    const int size = isTall ? image.width() / (layout == PanoramaLayout::HorizontalCross ? 4 : 3)
                            : std::min(image.width(), image.height());
    const glm::dvec2 corner(faces.cell[std::size_t(at.face)][0] * size, faces.cell[std::size_t(at.face)][1] * size);
    low = corner + 0.5;
    high = corner + double(size) - 0.5;
    return corner + glm::dvec2(at.u, at.v) * double(size);
}

glm::dvec3 colorAt(const ImageF& image, const glm::dvec2& place, const glm::dvec2& low, const glm::dvec2& high)
{
    const glm::dvec2 p = glm::clamp(place, low, high) - 0.5;
    const int x0 = int(p.x), y0 = int(p.y);
    const int x1 = std::min(x0 + 1, int(high.x - 0.5)), y1 = std::min(y0 + 1, int(high.y - 0.5));
    const double a = p.x - x0, b = p.y - y0;
    const auto texel = [&](int x, int y) {
        const float* t = image.pixel(x, y);
        return glm::dvec3(t[0], t[1], t[2]);
    };
    return (1 - b) * ((1 - a) * texel(x0, y0) + a * texel(x1, y0)) + b * ((1 - a) * texel(x0, y1) + a * texel(x1, y1));
}

/// Whether the cells that a cross leaves unused hold one colour (black, white, transparent), and the faces do not.
bool hasEmptyCorners(const ImageF& image, int across, const std::vector<std::array<int, 2>>& empty)
{
    const int size = image.width() / across;
    const float* first = image.pixel(empty[0][0] * size + size / 2, empty[0][1] * size + size / 2);
    const int inset = std::max(1, size / 16);  // faces may bleed
    for (const auto& [cx, cy] : empty) {
        for (int y = cy * size + inset; y < (cy + 1) * size - inset; ++y) {
            for (int x = cx * size + inset; x < (cx + 1) * size - inset; ++x) {
                for (int c = 0; c < 3; ++c) {
                    const float value = image.at(x, y, c);
                    if (!(std::abs(value - first[c]) <= 0.02f + 0.02f * std::abs(first[c])) &&
                        !(std::isnan(value) && std::isnan(first[c])))
                        return false;
                }
            }
        }
    }
    for (int k = 0; k < size; ++k) {
        const float* inFace = image.pixel(size + k, size + k);  // ahead, in both crosses
        for (int c = 0; c < 3; ++c) {
            if (std::abs(inFace[c] - first[c]) > 0.02f + 0.02f * std::abs(first[c])) return true;
        }
    }
    return false;
}

/// Mean difference of two places of a picture, over matching edges, relative to their brightness.
double stripDifference(const ImageF& image, bool isCube)
{
    const int size = image.height();
    double apart = 0.0, level = 0.0;
    const auto compare = [&](int x0, int y0, int x1, int y1) {
        for (int c = 0; c < 3; ++c) {
            const double a = image.at(x0, y0, c), b = image.at(x1, y1, c);
            if (!std::isfinite(a + b)) continue;
            apart += std::abs(a - b);
            level += std::abs(a) + std::abs(b);
        }
    };
    for (int i = 0; i < size; ++i) {
        if (isCube) {
            // Around the horizon: +Z right to +X left, +X right to -Z left, -Z right to -X left, -X right to +Z left.
            compare(5 * size - 1, i, 0, i);
            compare(size - 1, i, 5 * size, i);
            compare(6 * size - 1, i, size, i);
            compare(2 * size - 1, i, 4 * size, i);
            compare(4 * size + i, 0, 2 * size + i, size - 1);  // +Z top to +Y bottom
            compare(4 * size + i, size - 1, 3 * size + i, 0);  // +Z bottom to -Y top
        } else {
            for (int k = 1; k <= 5; ++k) compare(k * size - 1, i, k * size, i);
            compare(6 * size - 1, i, 0, i);
        }
    }
    return level > 0.0 ? apart / level : 0.0;
}

}  // namespace

std::optional<PanoramaLayout> layoutNamed(std::string_view name, int width, int height)
{
    if (name.empty() || name == "auto") return PanoramaLayout::Auto;
    if (name == "sphere") return PanoramaLayout::Sphere;
    if (name == "band") return PanoramaLayout::Band;
    if (name == "cross") return width > height ? PanoramaLayout::HorizontalCross : PanoramaLayout::VerticalCross;
    if (name == "strip") return width > height ? PanoramaLayout::HorizontalStrip : PanoramaLayout::VerticalStrip;
    if (name == "angular") return PanoramaLayout::AngularMap;
    if (name == "mirrorball") return PanoramaLayout::MirrorBall;
    return std::nullopt;
}

std::string layoutInWords(PanoramaLayout layout)
{
    switch (layout) {
        case PanoramaLayout::Auto: break;
        case PanoramaLayout::Uniform: return "a uniform sphere";
        case PanoramaLayout::Sphere: return "a full sphere";
        case PanoramaLayout::Band: return "a band around the horizon";
        case PanoramaLayout::HorizontalCross: return "a cube map as a horizontal cross";
        case PanoramaLayout::VerticalCross: return "a cube map as a vertical cross";
        case PanoramaLayout::HorizontalStrip: return "a cube map as a horizontal strip";
        case PanoramaLayout::VerticalStrip: return "a cube map as a vertical strip";
        case PanoramaLayout::AngularMap: return "a light probe (angular map)";
        case PanoramaLayout::MirrorBall: return "a mirror ball";
    }
    return "unknown";
}

PanoramaLayout recognisedLayout(const ImageF& image, const std::string& name)
{
    const int width = image.width(), height = image.height();
    const double ratio = double(width) / height;
    if (width == 1 && height == 1) return PanoramaLayout::Uniform;
    if (isRatio(image, 4, 3) && width >= 32 &&
        hasEmptyCorners(image, 4, {{0, 0}, {2, 0}, {3, 0}, {0, 2}, {2, 2}, {3, 2}}))
        return PanoramaLayout::HorizontalCross;
    if (isRatio(image, 3, 4) && width >= 24 &&
        hasEmptyCorners(image, 3, {{0, 0}, {2, 0}, {0, 2}, {2, 2}, {0, 3}, {2, 3}}))
        return PanoramaLayout::VerticalCross;
    if (isRatio(image, 1, 6)) return PanoramaLayout::VerticalStrip;
    // A band of 360 x 60 degrees has this shape as well, but has no seams between the sixths.
    if (isRatio(image, 6, 1) && height >= 8 && stripDifference(image, true) < 0.5 * stripDifference(image, false))
        return PanoramaLayout::HorizontalStrip;
    if (ratio >= 1.9) return ratio <= 2.1 ? PanoramaLayout::Sphere : PanoramaLayout::Band;
    const char* const guess =
        width == height ? "; a square may be a light probe or a mirror ball: --layout angular or "
                          "--layout mirrorball says which"
        : isRatio(image, 4, 3) || isRatio(image, 3, 4)
            ? "; a cube map's cross has empty corners: --layout cross takes it for one all the same"
            : "";
    throw Error(ErrorCode::Input,
                "{}: {} x {} pixels is no panorama; it must be twice as wide as high (equirectangular, a full sphere), "
                "wider (a band around the horizon) or a cube map{}",
                name, width, height, guess);
}

void requireLayout(PanoramaLayout layout, const ImageF& image, const std::string& name)
{
    const int width = image.width(), height = image.height();
    const auto require = [&](bool holds, const char* shape) {
        if (!holds)
            throw Error(ErrorCode::Input, "{}: {} x {} pixels cannot be {}, which must be {}", name, width, height,
                        layoutInWords(layout), shape);
    };
    switch (layout) {
        case PanoramaLayout::Auto:
        case PanoramaLayout::Uniform: break;
        case PanoramaLayout::Sphere: require(width >= 2 && height >= 1, "2 pixels wide or more"); break;
        case PanoramaLayout::Band: require(width >= 2 * height, "twice as wide as high or wider"); break;
        case PanoramaLayout::HorizontalCross: require(isRatio(image, 4, 3), "4:3"); break;
        case PanoramaLayout::VerticalCross: require(isRatio(image, 3, 4), "3:4"); break;
        case PanoramaLayout::HorizontalStrip: require(isRatio(image, 6, 1), "6:1"); break;
        case PanoramaLayout::VerticalStrip: require(isRatio(image, 1, 6), "1:6"); break;
        case PanoramaLayout::AngularMap:
        case PanoramaLayout::MirrorBall: require(width == height && width >= 4, "square, 4 pixels or more"); break;
    }
}

ImageF unfolded(const ImageF& image, PanoramaLayout layout)
{
    int around = 4;
    switch (layout) {
        case PanoramaLayout::HorizontalCross: around = image.width(); break;
        case PanoramaLayout::VerticalCross: around = image.width() / 3 * 4; break;
        case PanoramaLayout::HorizontalStrip: around = image.height() * 4; break;
        case PanoramaLayout::VerticalStrip: around = image.width() * 4; break;
        default: around = int(std::lround(pi * image.width() / 2.0)) * 2;
    }
    const int width = std::max(4, around + around % 2), height = width / 2;
    ImageF sphere(width, height, 3);
    parallelFor(0, height, 4, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y) {
            for (int x = 0; x < width; ++x) {
                glm::dvec3 sum(0.0);
                for (const double j : {0.25, 0.75}) {
                    for (const double i : {0.25, 0.75}) {
                        glm::dvec2 low, high;
                        const glm::dvec2 place =
                            placeOf(sh::panoramaDirection(x + i, y + j, width, height), layout, image, low, high);
                        sum += colorAt(image, place, low, high);
                    }
                }
                for (int c = 0; c < 3; ++c) sphere.at(x, y, c) = float(sum[c] / 4.0);
            }
        }
    });
    return sphere;
}

}  // namespace virga::environment
