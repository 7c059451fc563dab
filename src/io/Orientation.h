// The way up of a picture: how the coded picture is turned and mirrored to be shown (ISO 14496-12, 6.2.2).
#pragma once

#include <string>

#include "core/Image.h"

struct AVStream;

namespace virga::io {

/// One of the eight ways that a picture can lie: first rows and columns are exchanged, then each axis is reversed.
struct Orientation {
    bool swap = false, reverseX = false, reverseY = false;

    bool isIdentity() const { return !swap && !reverseX && !reverseY; }
    /// "upright", "turned by 90 degrees clockwise", "mirrored left to right", ...: what is done to the coded picture.
    const char* words() const;
};

/// The stream's display matrix. Quarter turns and mirrors are honoured; for another angle there is a warning that names
/// `name`, and the picture stays as it is.
Orientation orientationOf(const AVStream* stream, const std::string& name);

/// Turns pixels. `shown` has the size after the turn and as many channels.
void orient(const ImageF& coded, const Orientation& orientation, ImageF& shown);

}  // namespace virga::io
