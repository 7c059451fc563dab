// Named colour spaces, and the way from each to the working space: scene-linear light in the plate's own primaries.
//
// Display-referred video (transfer BT.709, 601, 2020 or not stated) is linearised with the sRGB curve, like a still
// with the same codes. Of the three candidates the sRGB curve is the one that (a) has a finite slope at black both
// ways, so that light added to a black pixel and 8- to 16-bit codes come back without being magnified, which a pure
// power of 2.4 does not; (b) is what artists see on their monitors, which the camera curve of BT.709 is not; (c) makes
// a movie and the PNG frames taken from it the same picture. "Rec.709 BT.1886" and "Rec.709 camera" may be asked for by
// name.
//
// Names are looked up in the configuration that $OCIO names, if it is set, then in ours.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "io/ColorTransform.h"
#include "io/Curve.h"

namespace virga::io {

/// Chromaticities of the red, green and blue primaries and the white, CIE 1931 x and y.
struct Primaries {
    const char* linearName;  ///< the colour space that is linear in these, "Linear Rec.709"
    double red[2], green[2], blue[2], white[2];
};

/// One of our own spaces: a curve over a set of primaries.
struct NamedSpace {
    const char* name;
    Curve curve;
    const Primaries* primaries;  ///< null: data, not a colour
};
const std::vector<NamedSpace>& ownColorspaces();

/// Our space of that name (case does not matter), or null.
const NamedSpace* findOwnColorspace(std::string_view name);
/// Our space with this curve and these primaries (by the name of their linear space), or null.
const NamedSpace* findOwnColorspace(Curve curve, std::string_view linearName);
/// Primaries whose chromaticities are within 0.002 of these eight (red x, red y, ... white y), or null.
const Primaries* findPrimaries(const float chromaticities[8]);

/// Primaries of a space of ours; null for data and for spaces of $OCIO.
const Primaries* primariesOf(const std::string& colorspace);

/// The name as its configuration spells it. Throws Error(InvalidArgument) with the nearest names for an unknown one,
/// with all names for "list".
std::string resolveColorspace(const std::string& name);
/// What $OCIO's file rules say of this file; empty if there is no $OCIO or only its default rule matches.
std::string colorspaceFromFileRules(const std::string& path);

/// The linear space that pictures of `colorspace` are worked on in.
std::string workingColorspace(const std::string& colorspace);

/// From one named space to another. Throws Error(InvalidArgument) if a name is unknown or there is no way between them.
std::shared_ptr<const ColorTransform> makeColorTransform(const std::string& from, const std::string& to);

}  // namespace virga::io
