// What the readers of camera tracks share: a text cut into lines and words, numbers that are numbers, and matrices that
// are cameras. `place` is where a fault is, "camera track 'a.chan', line 3": the beginning of every sentence.
#pragma once

#include <glm/mat4x4.hpp>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "camera/Camera.h"

namespace virga::camera {

/// Line after line of a text; "\n" and "\r\n" end one.
class TextLines {
public:
    explicit TextLines(std::string_view text) : rest_(text) {}

    /// The next line, nothing after the last.
    std::optional<std::string_view> next();
    int number() const { return number_; }  ///< of the line that next() gave, from 1

private:
    std::string_view rest_;
    int number_ = 0;
};

/// Words between blanks, tabs and commas; '#' begins a comment.
std::vector<std::string_view> wordsOf(std::string_view line);

/// A word of the file, short enough and printable, for a sentence.
std::string inQuotes(std::string_view word);

/// Throws Error(Input) for what is no finite number.
double numberFrom(std::string_view word, const std::string& place);

/// A whole number of at most fifteen digits. Throws Error(Input).
FrameNumber frameFrom(double number, const std::string& place);
/// The last number in a file's name: "left/frame_0012.png" is frame 12. Throws Error(Input).
FrameNumber frameFromName(std::string_view name, const std::string& place);

/// [rad] of [deg] over 0 and under 180. Throws Error(Input).
double verticalFovFrom(double degrees, const std::string& place);

/// Adds a pose. Throws Error(Input) if the frame has one already.
void addPose(std::map<FrameNumber, Pose>& poses, FrameNumber frame, const Pose& pose, const std::string& place);

/// Pose of a camera that looks down its -z with +y up, from the matrix that takes column vectors from the camera to the
/// world. A scale that is alike along all axes (a scaled scene) is taken out of the rotation. Throws Error(Input) for
/// values that are not finite, a last row that is not 0 0 0 1, and axes that are singular, mirrored, or off right
/// angles or equal lengths by over 0.1 %.
Pose poseFromMatrix(const glm::dmat4& worldFromCamera, const std::string& place);

}  // namespace virga::camera
