#pragma once

#include <set>
#include <string>
#include <vector>

#include "core/FrameRange.h"
#include "io/Plate.h"
#include "shot/Settings.h"

namespace virga::shot {

/// A few frames of the whole plate, whatever range is rendered, so that every range sees the same: what a shot's light
/// and its grade are judged by.
struct PlateSamples {
    struct Frame {
        FrameNumber number = 0;
        ImageF pixels;
    };
    std::vector<Frame> forLight;   ///< `--env-frames` of them, evenly spread, averaged down to at most 480 columns
    std::vector<ImageF> forGrade;  ///< first, middle and last, whole
};

/// Of one frame: every so many rows, averaged along them, at most 480 columns. As good as all of them for light, which
/// averages far more, and a fraction of the work.
ImageF sampledForLight(const RowSource& plate);

/// Of a frame that stands for others: averaged down as PlateSamples::forLight says. Of all rows, as a lamp may be a few
/// rows high; they are made a few at a time.
ImageF averagedForLight(const RowSource& plate);

/// Which of so many frames in order stand for all of them: places from 0 on.
std::set<std::size_t> placesForLight(std::size_t frames, const Settings& settings);
std::set<std::size_t> placesForGrade(std::size_t frames, const Settings& settings);

/// Reads what the settings ask for: light without `--env`, colour transfer. Frames that cannot be read are left out.
/// standsStill: nobody says how the camera moves. Then light needs frames that are steady (isSteady), and is read no
/// further than to the first that is not: a movie may have to be decoded from its start to each.
PlateSamples samplePlate(io::PlateReader& reader, const Settings& settings, bool light, bool standsStill);

/// The frames that samplePlate would read if there is light to be made.
std::vector<FrameNumber> sampledFrames(const io::PlateInfo& plate, const Settings& settings);

/// Whether the frames show one scene in one light from one place: people may walk through, but no camera that turns or
/// travels, no cut and no dusk. 48 columns of luminance are compared; `why` says what is not so.
bool isSteady(const std::vector<PlateSamples::Frame>& frames, std::string& why);

}  // namespace virga::shot
