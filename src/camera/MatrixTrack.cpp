#include "camera/MatrixTrack.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <nlohmann/json.hpp>
#include <numbers>

#include "camera/TrackText.h"
#include "core/Error.h"
#include "core/Words.h"

namespace virga::camera {
namespace {

using nlohmann::json;
using Numbers = std::array<double, 16>;
constexpr Numbers lastRow = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};

Pose poseFrom(const Numbers& numbers, const MatrixLayout& layout, const std::string& place)
{
    glm::dmat4 m;
    for (int i = 0; i < 16; ++i) (layout.byColumns ? m[i / 4][i % 4] : m[i % 4][i / 4]) = numbers[std::size_t(i)];
    Pose pose = poseFromMatrix(m, place);
    if (layout.worldToCamera) {
        // A scale of the matrix is one of the camera's axes here: what is left over goes into the position.
        const double scale = std::cbrt(glm::determinant(glm::dmat3(m)));
        pose.worldFromCamera = glm::transpose(pose.worldFromCamera);
        pose.position = -(pose.worldFromCamera * pose.position) / scale;
    }
    if (layout.looksAlongZ) {
        pose.worldFromCamera[1] = -pose.worldFromCamera[1];
        pose.worldFromCamera[2] = -pose.worldFromCamera[2];
    }
    return pose;
}

double numberIn(const json& value, const std::string& place)
{
    if (!value.is_number()) throw Error(ErrorCode::Input, "{}: {} is not a number", place, inQuotes(value.dump()));
    return value.get<double>();
}

Numbers numbersIn(const json& matrix, const std::string& place)
{
    Numbers numbers{};
    std::size_t count = 0;
    const auto add = [&](const json& value) {
        if (count == numbers.size()) throw Error(ErrorCode::Input, "{}: the matrix has over 16 numbers", place);
        numbers[count++] = numberIn(value, place);
    };
    if (!matrix.is_array()) throw Error(ErrorCode::Input, "{}: {} is not a matrix", place, inQuotes(matrix.dump()));
    for (const json& item : matrix) {
        if (!item.is_array()) {
            add(item);
            continue;
        }
        if (item.size() != 4)
            throw Error(ErrorCode::Input, "{}: the matrix has a row of {} numbers, not 4", place, item.size());
        for (const json& value : item) add(value);
    }
    if (count != numbers.size()) throw Error(ErrorCode::Input, "{}: the matrix has {} numbers, not 16", place, count);
    return numbers;
}

/// Vertical field of view [rad] by what this object says, nothing if it does not. saysWidthAlone: it gives a horizontal
/// one, but not the picture's shape.
std::optional<double> fieldOfViewIn(const json& object, const std::string& place, bool& saysWidthAlone)
{
    const auto value = [&](const char* key) -> std::optional<double> {
        const auto found = object.find(key);
        if (found == object.end()) return std::nullopt;
        return numberIn(*found, fmt::format("{}, \"{}\"", place, key));
    };
    const auto checked = [&](double radians) { return verticalFovFrom(glm::degrees(radians), place); };
    if (const auto degrees = value("vfov_deg")) return verticalFovFrom(*degrees, place);
    if (const auto angle = value("camera_angle_y")) return checked(*angle);
    const auto width = value("w"), height = value("h"), focalY = value("fl_y"), focalX = value("fl_x"),
               angleX = value("camera_angle_x");
    if (const auto focal = focalY ? focalY : focalX; focal && height && *focal > 0)
        return checked(2 * std::atan(0.5 * *height / *focal));
    if (angleX && width && height && *width > 0)
        return checked(2 * std::atan(std::tan(0.5 * *angleX) * *height / *width));
    if (angleX || focalX || focalY) saysWidthAlone = true;
    return std::nullopt;
}

const json* firstOf(const json& object, std::initializer_list<const char*> keys)
{
    for (const char* key : keys)
        if (const auto found = object.find(key); found != object.end()) return &*found;
    return nullptr;
}

void readFrames(const json& top, const std::string& name, const MatrixLayout& layout,
                std::map<FrameNumber, Pose>& poses, bool& saysWidthAlone)
{
    const json& frames = top["frames"];
    const std::string file = fmt::format("camera track '{}'", name);
    if (!frames.is_array()) throw Error(ErrorCode::Input, "{}: its \"frames\" is not a list", file);
    const std::optional<double> common = fieldOfViewIn(top, file, saysWidthAlone);
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const std::string place = fmt::format("{}, frames[{}]", file, i);
        const json& item = frames[i];
        if (!item.is_object()) throw Error(ErrorCode::Input, "{}: is not an object", place);
        const json* const matrix = firstOf(item, {"matrix", "transform_matrix"});
        const json* const number = firstOf(item, {"frame"});
        const json* const path = firstOf(item, {"file_path"});
        if (matrix == nullptr)
            throw Error(ErrorCode::Input, "{}: has neither \"matrix\" nor \"transform_matrix\"", place);
        if (number == nullptr && (path == nullptr || !path->is_string()))
            throw Error(ErrorCode::Input, "{}: has neither a \"frame\" nor a \"file_path\"", place);
        const FrameNumber frame = number != nullptr ? frameFrom(numberIn(*number, place), place)
                                                    : frameFromName(path->get_ref<const std::string&>(), place);
        Pose pose = poseFrom(numbersIn(*matrix, place), layout, place);
        const std::optional<double> own = fieldOfViewIn(item, place, saysWidthAlone);
        pose.verticalFov = own ? own : common;
        addPose(poses, frame, pose, place);
    }
}

}  // namespace

TrackReading parseMatrixText(std::string_view text, const std::string& name, const MatrixLayout& layout)
{
    std::map<FrameNumber, Pose> poses;
    std::size_t perLine = 0;
    FrameNumber counted = 0;
    TextLines lines(text);
    while (const auto line = lines.next()) {
        const auto words = wordsOf(*line);
        if (words.empty()) continue;
        const std::string place = fmt::format("camera track '{}', line {}", name, lines.number());
        std::vector<double> numbers;
        for (const std::string_view word : words) numbers.push_back(numberFrom(word, place));
        if (perLine == 0) perLine = numbers.size();
        const bool is3x4 = perLine >= 12 && perLine <= 14;
        if (numbers.size() != perLine || !(is3x4 || (perLine >= 16 && perLine <= 18)))
            throw Error(ErrorCode::Input,
                        "{}: {} numbers{}; a matrix list has 'frame', 16 (or 12) numbers and 'vfov' a line, the first "
                        "and last as all lines have them or none",
                        place, numbers.size(),
                        numbers.size() != perLine ? fmt::format(" after lines of {}", perLine) : "");
        if (is3x4 && layout.byColumns)
            throw Error(ErrorCode::Input, "{}: a matrix of 12 numbers stands row by row, not --camera-layout column",
                        place);
        const std::size_t size = is3x4 ? 12 : 16, frames = perLine > size ? 1 : 0;
        Numbers matrix = lastRow;
        std::copy_n(numbers.begin() + std::ptrdiff_t(frames), size, matrix.begin());
        Pose pose = poseFrom(matrix, layout, place);
        if (perLine == size + 2) pose.verticalFov = verticalFovFrom(numbers.back(), place);
        addPose(poses, frames > 0 ? frameFrom(numbers[0], place) : counted++, pose, place);
    }
    if (poses.empty()) throw Error(ErrorCode::Input, "camera track '{}' holds no frame", name);
    return {Track(std::move(poses)), {}, "matrix list"};
}

TrackReading parseMatrixJson(std::string_view text, const std::string& name, const MatrixLayout& layout)
{
    const std::string file = fmt::format("camera track '{}'", name);
    if (isNestedDeeper(text)) throw Error(ErrorCode::Input, "{}: is no list of matrices: it is nested too deep", file);
    json top;
    try {
        top = json::parse(text);
    } catch (const json::exception& error) {
        // "[json.exception.parse_error.101] parse error at line 3, column 5: ..."
        const std::string what = error.what();
        throw Error(ErrorCode::Input, "{}: is not JSON: {}", file,
                    what.substr(std::min(what.find("] ") + 2, what.size())));
    }
    std::map<FrameNumber, Pose> poses;
    bool saysWidthAlone = false;
    if (top.is_array()) {
        for (std::size_t i = 0; i < top.size(); ++i) {
            const std::string place = fmt::format("{}, matrix {}", file, i);
            addPose(poses, FrameNumber(i), poseFrom(numbersIn(top[i], place), layout, place), place);
        }
    } else if (top.contains("frames")) {
        readFrames(top, name, layout, poses, saysWidthAlone);
    } else {
        for (const auto& [key, matrix] : top.items()) {
            const std::string place = fmt::format("{}, {}", file, inQuotes(key));
            const FrameNumber frame = frameFrom(numberFrom(key, place), place);
            addPose(poses, frame, poseFrom(numbersIn(matrix, place), layout, place), place);
        }
    }
    if (poses.empty()) throw Error(ErrorCode::Input, "{} holds no frame", file);
    TrackReading reading{Track(std::move(poses)), {}, "matrix list (JSON)"};
    if (saysWidthAlone)
        reading.notes.push_back(
            fmt::format("{}: gives a horizontal field of view, but not the picture's size; --fov sets it", file));
    return reading;
}

}  // namespace virga::camera
