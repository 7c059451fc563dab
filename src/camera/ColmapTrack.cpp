#include "camera/ColmapTrack.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>

#include "camera/TrackText.h"
#include "core/Error.h"

namespace virga::camera {
namespace {

/// One of COLMAP's lens models: how many of its parameters are focal lengths, and its distortion after f, cx, cy.
struct LensModel {
    const char* name;
    int focals, radial, tangential;
    int parameters() const { return focals + 2 + radial + tangential; }
};
constexpr LensModel lensModels[] = {
    {"SIMPLE_PINHOLE", 1, 0, 0}, {"PINHOLE", 2, 0, 0}, {"SIMPLE_RADIAL", 1, 1, 0},
    {"RADIAL", 1, 2, 0},         {"OPENCV", 2, 2, 2},
};

struct Lens {
    double verticalFov;  // [rad]
    std::vector<std::string> ignored;
};

const LensModel& modelOf(std::string_view name, const std::string& place)
{
    std::string known;
    for (const LensModel& model : lensModels) {
        if (name == model.name) return model;
        known += (known.empty() ? "" : ", ") + std::string(model.name);
    }
    throw Error(ErrorCode::Input, "{}: the lens model {} is not read; undistort the images, or use one of {}", place,
                inQuotes(name), known);
}

/// How far the distortion moves a corner of the picture [px]; x and y are the corner's over the focal length.
double cornerShift(const LensModel& model, const double* k, double x, double y, double focal)
{
    const double r2 = x * x + y * y;
    const double radial = (model.radial > 0 ? k[0] * r2 : 0) + (model.radial > 1 ? k[1] * r2 * r2 : 0);
    glm::dvec2 shift = radial * glm::dvec2(x, y);
    if (model.tangential > 0)
        shift += glm::dvec2(2 * k[2] * x * y + k[3] * (r2 + 2 * x * x), 2 * k[3] * x * y + k[2] * (r2 + 2 * y * y));
    return focal * glm::length(shift);
}

Lens lensFrom(const std::vector<std::string_view>& words, const std::string& place)
{
    if (words.size() < 4)
        throw Error(ErrorCode::Input, "{}: {} words, but a lens is 'id model width height parameters'", place,
                    words.size());
    const LensModel& model = modelOf(words[1], place);
    if (words.size() != std::size_t(4 + model.parameters()))
        throw Error(ErrorCode::Input, "{}: {} has {} parameters, not {}", place, model.name, model.parameters(),
                    words.size() - 4);
    const double width = numberFrom(words[2], place), height = numberFrom(words[3], place);
    std::vector<double> p;
    for (std::size_t i = 4; i < words.size(); ++i) p.push_back(numberFrom(words[i], place));
    const double fx = p[0], fy = p[std::size_t(model.focals - 1)];
    if (!(width >= 1 && height >= 1)) throw Error(ErrorCode::Input, "{}: a picture of {}x{}", place, width, height);
    if (!(fx > 0 && fy > 0))
        throw Error(ErrorCode::Input, "{}: focal length {} must be over 0", place, std::min(fx, fy));
    const double cx = p[std::size_t(model.focals)], cy = p[std::size_t(model.focals + 1)];

    Lens lens{verticalFovFrom(glm::degrees(2 * std::atan(0.5 * height / fy)), place), {}};
    constexpr double noticed_px = 0.5;
    const double offMiddle = std::hypot(cx - 0.5 * width, cy - 0.5 * height);
    const double shift = cornerShift(model, p.data() + model.focals + 2, 0.5 * width / fx, 0.5 * height / fy, fx);
    const double stretch = 0.5 * width * std::abs(fx / fy - 1);
    if (!(shift <= noticed_px))
        lens.ignored.push_back(fmt::format(
            "its distortion, {:.1f} px at the corners, is ignored; undistort the plate and its model first", shift));
    if (offMiddle > noticed_px)
        lens.ignored.push_back(fmt::format("its principal point, {:.1f} px off the middle, is ignored", offMiddle));
    if (stretch > noticed_px)
        lens.ignored.push_back(
            fmt::format("its pixels are not square ({:.1f} px at the edge), which is ignored", stretch));
    return lens;
}

Pose poseFrom(const std::vector<double>& n, const std::string& place)
{
    const glm::dquat turn(n[0], n[1], n[2], n[3]);
    const double length = glm::length(turn);
    if (!(std::abs(length - 1) < 1e-2))
        throw Error(ErrorCode::Input, "{}: the quaternion's length is {:.3g}, not 1", place, length);
    const glm::dmat3 worldFromCamera = glm::transpose(glm::mat3_cast(turn / length));
    Pose pose;
    pose.position = -(worldFromCamera * glm::dvec3(n[4], n[5], n[6]));
    pose.worldFromCamera = {worldFromCamera[0], -worldFromCamera[1], -worldFromCamera[2]};
    return pose;
}

/// An image's name is all that follows the ninth word, blanks and commas included.
std::string_view nameAfter(std::string_view line, int words)
{
    for (int i = 0; i < words; ++i) {
        line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
        line.remove_prefix(std::min(line.find_first_of(" \t"), line.size()));
    }
    line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
    return line.substr(0, line.find_last_not_of(" \t") + 1);
}

std::map<std::string, Lens, std::less<>> lensesIn(std::string_view text, const std::string& folder)
{
    std::map<std::string, Lens, std::less<>> lenses;
    TextLines lines(text);
    while (const auto line = lines.next()) {
        const auto words = wordsOf(*line);
        if (words.empty()) continue;
        const std::string place = fmt::format("camera track '{}/cameras.txt', line {}", folder, lines.number());
        if (!lenses.emplace(words[0], lensFrom(words, place)).second)
            throw Error(ErrorCode::Input, "{}: camera {} is there twice", place, inQuotes(words[0]));
    }
    return lenses;
}

}  // namespace

TrackReading parseColmap(std::string_view cameras, std::string_view images, const std::string& name)
{
    constexpr std::size_t wordsBeforeName = 9;
    const auto lenses = lensesIn(cameras, name);
    std::map<FrameNumber, Pose> poses;
    std::map<std::string, bool, std::less<>> used;
    TextLines lines(images);
    while (const auto line = lines.next()) {
        const auto words = wordsOf(*line);
        if (words.empty()) continue;  // between images; an image's own line of points may be empty and is skipped below
        const std::string place = fmt::format("camera track '{}/images.txt', line {}", name, lines.number());
        const std::string_view image = nameAfter(*line, int(wordsBeforeName));
        if (words.size() < wordsBeforeName || image.empty())
            throw Error(ErrorCode::Input, "{}: {} words, but an image is 'id qw qx qy qz tx ty tz camera-id name'",
                        place, words.size());
        std::vector<double> numbers;
        for (std::size_t i = 1; i < wordsBeforeName - 1; ++i) numbers.push_back(numberFrom(words[i], place));
        const auto lens = lenses.find(words[8]);
        if (lens == lenses.end())
            throw Error(ErrorCode::Input, "{}: camera {} is not in cameras.txt", place, inQuotes(words[8]));
        used[lens->first] = true;
        Pose pose = poseFrom(numbers, place);
        pose.verticalFov = lens->second.verticalFov;
        addPose(poses, frameFromName(image, place), pose, place);
        lines.next();  // its points
    }
    if (poses.empty()) throw Error(ErrorCode::Input, "camera track '{}/images.txt' holds no image", name);
    TrackReading reading{Track(std::move(poses)), {}, "COLMAP"};
    for (const auto& [id, isUsed] : used)
        for (const std::string& what : lenses.find(id)->second.ignored)
            reading.notes.push_back(fmt::format("camera track '{}': camera {}: {}", name, inQuotes(id), what));
    return reading;
}

}  // namespace virga::camera
