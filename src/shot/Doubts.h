// What is legal but looks wrong in the material of a shot: units, frame ranges, spaces. Pure judgements of what has
// been read already, for the pre-flight (shot/Preflight.h) and, the serious ones, for a warning while rendering.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "camera/Camera.h"
#include "depth/DepthImage.h"
#include "io/Plate.h"
#include "shot/Settings.h"

namespace virga::shot {

enum class Severity {
    Ok,       ///< what was found, and nothing is wrong with it
    Note,     ///< a choice that the program made, for the user to know
    Warning,  ///< most likely not what is wanted
    Error,    ///< rendering would end here
};

struct Finding {
    Severity severity = Severity::Ok;
    std::string input;     ///< "plate", "depth", "camera", "env", "lights", "mattes", "grade-from", "output"
    std::string sentence;  ///< one, without a full stop
    std::string flag;      ///< that puts it right, as typed: "--depth-scale 0.001"; empty if there is none
};

/// Says the warnings among them to the user who renders.
void warnOf(const std::vector<Finding>& findings);

/// Colour space, rate, pixel aspect, fields. saysRate: the file or the user gives the frame rate.
std::vector<Finding> plateDoubts(const io::PlateInfo& plate, bool saysRate);

/// A track beside the frames that are rendered: frames without a pose, jumps (over 150 m/s), a camera that lies on its
/// side, or is under the ground of --ground. frames: at least one.
std::vector<Finding> trackDoubts(const camera::Track& track, const std::vector<FrameNumber>& frames, double fps,
                                 const Settings& settings);

/// What one stored depth image holds, before and after it became metres.
struct DepthSample {
    ConstImageViewF stored;      ///< one channel
    double full = 1;             ///< the largest value of the file's type; 1 for half and float
    const depth::Depth& metres;  ///< of the same size
};

/// Depth that looks like another unit: codes of a picture, a normalised map, millimetres, inverse depth; depth that is
/// mostly holes, or all sky.
std::vector<Finding> depthDoubts(const DepthSample& sample, const Settings& settings);

/// A depth image of another size than the plate; none if it is the same.
std::vector<Finding> depthSizeDoubts(int width, int height, const io::PlateInfo& plate);

/// A panorama by its header: shape and range.
Finding panoramaDoubt(int width, int height, bool isFloat);

}  // namespace virga::shot
