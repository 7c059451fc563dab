#include "camera/TrackText.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>

#include "core/Error.h"

namespace virga::camera {
namespace {

constexpr std::string_view separators = " \t\r\f\v,";
constexpr double mostFrame = 1e15;  // far below where doubles leave out whole numbers

/// The rotation nearest to `m`: Higham 1986, "Computing the polar decomposition", Newton's iteration, which doubles the
/// right digits each time.
glm::dmat3 nearestRotation(glm::dmat3 m)
{
    for (int i = 0; i < 4; ++i) m = 0.5 * (m + glm::inverse(glm::transpose(m)));
    return m;
}

}  // namespace

std::optional<std::string_view> TextLines::next()
{
    if (rest_.empty()) return std::nullopt;
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    ++number_;
    return line;
}

std::vector<std::string_view> wordsOf(std::string_view line)
{
    line = line.substr(0, line.find('#'));
    std::vector<std::string_view> words;
    for (;;) {
        const std::size_t start = line.find_first_not_of(separators);
        if (start == std::string_view::npos) return words;
        const std::size_t end = std::min(line.find_first_of(separators, start), line.size());
        words.push_back(line.substr(start, end - start));
        line.remove_prefix(end);
    }
}

std::string inQuotes(std::string_view word)
{
    constexpr std::size_t longest = 40;
    std::string text(word.substr(0, longest));
    std::replace_if(
        text.begin(), text.end(), [](unsigned char c) { return c < 32 || c > 126; }, '?');
    return "'" + text + (word.size() > longest ? "...'" : "'");
}

double numberFrom(std::string_view word, const std::string& place)
{
    double number = 0;
    const std::string_view digits = word.starts_with('+') ? word.substr(1) : word;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    if (error != std::errc() || end != digits.data() + digits.size() || !std::isfinite(number))
        throw Error(ErrorCode::Input, "{}: {} is not a number", place, inQuotes(word));
    return number;
}

FrameNumber frameFrom(double number, const std::string& place)
{
    if (!(std::abs(number) <= mostFrame) || number != std::round(number))
        throw Error(ErrorCode::Input, "{}: frame {} is not a whole number", place, number);
    return FrameNumber(number);
}

FrameNumber frameFromName(std::string_view name, const std::string& place)
{
    constexpr std::string_view digits = "0123456789";
    const std::string_view file = name.substr(name.find_last_of("/\\") + 1);
    const std::size_t last = file.substr(0, file.rfind('.')).find_last_of(digits);
    if (last == std::string_view::npos)
        throw Error(ErrorCode::Input, "{}: the image name {} holds no frame number", place, inQuotes(name));
    const std::size_t before = file.find_last_not_of(digits, last);
    const std::string_view number = file.substr(before + 1, last - before);
    return frameFrom(numberFrom(number, place), place);
}

double verticalFovFrom(double degrees, const std::string& place)
{
    if (!(degrees > 0 && degrees < 180))
        throw Error(ErrorCode::Input, "{}: vertical field of view {} deg must be over 0 and under 180", place, degrees);
    return glm::radians(degrees);
}

void addPose(std::map<FrameNumber, Pose>& poses, FrameNumber frame, const Pose& pose, const std::string& place)
{
    if (!poses.emplace(frame, pose).second) throw Error(ErrorCode::Input, "{}: frame {} is there twice", place, frame);
}

Pose poseFromMatrix(const glm::dmat4& m, const std::string& place)
{
    constexpr double tolerance = 1e-3;
    double largest = 0;
    for (int c = 0; c < 4; ++c)
        for (int r = 0; r < 4; ++r) {
            if (!std::isfinite(m[c][r])) throw Error(ErrorCode::Input, "{}: the matrix is not finite", place);
            if (c < 3 && r < 3) largest = std::max(largest, std::abs(m[c][r]));
        }
    if (m[0][3] != 0 || m[1][3] != 0 || m[2][3] != 0 || std::abs(m[3][3] - 1) > 1e-6)
        throw Error(ErrorCode::Input,
                    "{}: the matrix's last row is {:g} {:g} {:g} {:g}, not 0 0 0 1; --camera-layout says whether its "
                    "numbers stand row by row or column by column",
                    place, m[0][3], m[1][3], m[2][3], m[3][3]);
    // Divided first, so that neither tiny nor huge scenes leave the range of doubles.
    glm::dmat3 axes(m);
    if (largest > 0) axes /= largest;
    const double determinant = glm::determinant(axes);
    if (!(std::abs(determinant) > 1e-9)) throw Error(ErrorCode::Input, "{}: the matrix is singular", place);
    if (determinant < 0)
        throw Error(ErrorCode::Input, "{}: the matrix mirrors the scene (its determinant is below 0)", place);
    axes /= std::cbrt(determinant);
    double deviation = 0;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            deviation = std::max(deviation, std::abs(glm::dot(axes[i], axes[j]) - (i == j ? 1 : 0)));
    if (deviation > tolerance)
        throw Error(ErrorCode::Input,
                    "{}: the matrix is no rotation: its axes are off right angles or equal lengths by {:.2g}", place,
                    deviation);
    return {glm::dvec3(m[3]), nearestRotation(axes), std::nullopt};
}

}  // namespace virga::camera
