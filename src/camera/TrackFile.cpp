#include "camera/TrackFile.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <glm/gtc/quaternion.hpp>
#include <glm/trigonometric.hpp>
#include <iterator>

#include "camera/ColmapTrack.h"
#include "camera/MatrixTrack.h"
#include "camera/TrackText.h"
#include "core/Error.h"

namespace virga::camera {

namespace fs = std::filesystem;

namespace {

/// A track of a feature film has a few megabytes; beyond this it is some other file.
constexpr std::uintmax_t mostBytes = std::uintmax_t(1) << 30;

std::string readText(const std::string& path)
{
    std::error_code error;
    if (fs::is_directory(path, error)) throw Error(ErrorCode::Input, "camera track '{}': is a folder", path);
    if (fs::is_regular_file(path, error) && fs::file_size(path, error) > mostBytes)
        throw Error(ErrorCode::Input, "camera track '{}': has over {} MB, which no track has", path, mostBytes >> 20);
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    if (!file)
        throw Error(ErrorCode::Input, "camera track '{}': cannot be opened: {}", path,
                    errno != 0 ? std::strerror(errno) : "no such file");
    return {std::istreambuf_iterator<char>(file), {}};
}

/// What is a camera track to its program but not to us, and the way here.
void refuseOtherFormats(const std::string& path)
{
    struct Format {
        const char *extension, *name;
    };
    static constexpr Format formats[] = {
        {".abc", "Alembic"}, {".fbx", "FBX"}, {".usd", "USD"}, {".usda", "USD"},       {".usdc", "USD"},
        {".usdz", "USD"},    {".ma", "Maya"}, {".mb", "Maya"}, {".nk", "Nuke script"}, {".bin", "COLMAP binary"}};
    const std::string extension = fs::path(path).extension().string();
    for (const Format& format : formats)
        if (extension == format.extension)
            throw Error(ErrorCode::Input,
                        "camera track '{}': {} is not read; export the camera as .chan or as a list of matrices{}",
                        path, format.name,
                        extension == ".bin" ? ", or convert it with 'colmap model_converter --output_type TXT'" : "");
}

TrackReading readColmap(const std::string& folder)
{
    std::error_code ignored;
    const auto has = [&](const char* file) { return fs::exists(fs::path(folder) / file, ignored); };
    if (!has("cameras.txt") || !has("images.txt")) {
        const char* const hint =
            has("images.bin") ? "; there is a binary model: 'colmap model_converter --output_type TXT' converts it"
            : has("sparse/0") ? "; try its sparse/0"
                              : "";
        throw Error(ErrorCode::Input, "camera track '{}': is a folder without COLMAP's cameras.txt and images.txt{}",
                    folder, hint);
    }
    return parseColmap(readText((fs::path(folder) / "cameras.txt").string()),
                       readText((fs::path(folder) / "images.txt").string()), folder);
}

/// ours = world * the file's.
glm::dmat3 worldFromFile(WorldUp up)
{
    // Rotations about x alone: what is to the right stays there.
    switch (up) {
        case WorldUp::Y: return glm::dmat3(1.0);
        case WorldUp::Z: return {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}};
        case WorldUp::MinusY: return {{1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
        case WorldUp::MinusZ: return {{1, 0, 0}, {0, 0, 1}, {0, -1, 0}};
    }
    return glm::dmat3(1.0);
}

}  // namespace

glm::dmat3 rotation(RotationOrder order, double rx, double ry, double rz) noexcept
{
    const glm::dmat3 x = glm::mat3_cast(glm::angleAxis(rx, glm::dvec3(1, 0, 0)));
    const glm::dmat3 y = glm::mat3_cast(glm::angleAxis(ry, glm::dvec3(0, 1, 0)));
    const glm::dmat3 z = glm::mat3_cast(glm::angleAxis(rz, glm::dvec3(0, 0, 1)));
    switch (order) {
        case RotationOrder::XYZ: return z * y * x;
        case RotationOrder::XZY: return y * z * x;
        case RotationOrder::YXZ: return z * x * y;
        case RotationOrder::YZX: return x * z * y;
        case RotationOrder::ZXY: return y * x * z;
        case RotationOrder::ZYX: return x * y * z;
    }
    return glm::dmat3(1.0);
}

Track parseChan(std::string_view text, const std::string& name, RotationOrder order)
{
    std::map<FrameNumber, Pose> poses;
    TextLines lines(text);
    while (const auto line = lines.next()) {
        const auto words = wordsOf(*line);
        if (words.empty()) continue;
        const std::string place = fmt::format("camera track '{}', line {}", name, lines.number());
        std::vector<double> numbers;
        for (const std::string_view word : words) numbers.push_back(numberFrom(word, place));
        if (numbers.size() < 7 || numbers.size() > 8)
            throw Error(ErrorCode::Input, "{}: {} numbers, but 'frame tx ty tz rx ry rz [vfov]' needs 7 or 8", place,
                        numbers.size());
        Pose pose;
        pose.position = {numbers[1], numbers[2], numbers[3]};
        pose.worldFromCamera =
            rotation(order, glm::radians(numbers[4]), glm::radians(numbers[5]), glm::radians(numbers[6]));
        if (numbers.size() > 7) pose.verticalFov = verticalFovFrom(numbers[7], place);
        addPose(poses, frameFrom(numbers[0], place), pose, place);
    }
    if (poses.empty()) throw Error(ErrorCode::Input, "camera track '{}' holds no frame", name);
    return Track(std::move(poses));
}

Track inOurWorld(const Track& track, const TrackOptions& options)
{
    const glm::dmat3 turn = worldFromFile(options.up);
    std::map<FrameNumber, Pose> poses;
    for (const auto& [frame, pose] : track.poses())
        poses.emplace(frame + options.frameOffset,
                      Pose{options.scale * (turn * pose.position), turn * pose.worldFromCamera, pose.verticalFov});
    return Track(std::move(poses));
}

TrackReading parseTrack(std::string_view text, const std::string& name, const TrackOptions& options)
{
    // The fewest numbers of a line that holds a matrix; a .chan's have at most 8, with room for one too many.
    constexpr std::size_t fewestOfMatrix = 12;
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // a byte order mark
    TrackReading reading;
    const std::size_t start = text.find_first_not_of(" \t\r\n");
    if (start != std::string_view::npos && (text[start] == '{' || text[start] == '[')) {
        reading = parseMatrixJson(text, name, options.matrix);
    } else {
        std::size_t words = 0;
        TextLines lines(text);
        for (auto line = lines.next(); line && words == 0; line = lines.next()) words = wordsOf(*line).size();
        if (words >= fewestOfMatrix)
            reading = parseMatrixText(text, name, options.matrix);
        else
            reading = {parseChan(text, name, options.rotationOrder), {}, "Nuke .chan"};
    }
    reading.track = inOurWorld(reading.track, options);
    return reading;
}

TrackReading readTrack(const std::string& path, const TrackOptions& options)
{
    std::error_code ignored;
    if (fs::is_directory(path, ignored)) {
        TrackReading reading = readColmap(path);
        reading.track = inOurWorld(reading.track, options);
        return reading;
    }
    refuseOtherFormats(path);
    const std::string file = fs::path(path).filename().string();
    if ((file == "images.txt" || file == "cameras.txt") && fs::exists(fs::path(path).parent_path() / "cameras.txt"))
        throw Error(ErrorCode::Input, "camera track '{}': is a part of a COLMAP model; name its folder", path);
    return parseTrack(readText(path), path, options);
}

}  // namespace virga::camera
