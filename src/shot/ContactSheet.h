#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/FrameRange.h"
#include "core/Image.h"

namespace virga::io {
struct PlateInfo;
}

namespace virga::shot {

/// A before/after contact sheet of a few frames spread over the shot (`--preview`).
class ContactSheet {
public:
    /// path: a PNG; empty makes a sheet that does nothing. frames: those that will be rendered.
    ContactSheet(std::string path, const std::vector<FrameNumber>& frames);

    void addBefore(FrameNumber frame, ConstImageViewF plate);
    void addAfter(FrameNumber frame, ConstImageViewF beauty);
    /// Before in the left column, after in the right, a frame a row; from the plate's working space. Throws
    /// Error(Output).
    void write(const io::PlateInfo& plate) const;

private:
    bool isWanted(FrameNumber frame) const;
    std::string path_;
    std::vector<FrameNumber> frames_;
    std::map<FrameNumber, ImageF> before_, after_;
};

}  // namespace virga::shot
