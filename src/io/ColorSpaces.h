// Our own colour spaces: a curve over a set of primaries, under names that people know. They are there whether or not
// an OpenColorIO configuration is named (ColorConversion.h); docs/colour.md lists them.
//
// Display-referred video (transfer BT.709, 601, 2020 or not stated) is linearised with the sRGB curve, like a still
// with the same codes. Of the three candidates the sRGB curve is the one that (a) has a finite slope at black both
// ways, so that light added to a black pixel and 8- to 16-bit codes come back without being magnified, which a pure
// power of 2.4 does not; (b) is what artists see on their monitors, which the camera curve of BT.709 is not; (c) makes
// a movie and the PNG frames taken from it the same picture. "Rec.709 BT.1886" and "Rec.709 camera" may be asked for by
// name.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/Curve.h"
#include "io/Primaries.h"

namespace virga::io {

struct NamedSpace {
    std::string name;
    Curve curve;
    const Primaries* primaries;  ///< null: data, not a colour
    const char* family;          ///< "ACES", "display", "camera", "linear", "utility"
    std::vector<std::string> aliases;
    std::string interopId;  ///< of the ASWF Color Interop Forum's list, "lin_ap1_scene"; empty if it has none
};

/// All of them, in the order of the list that users see.
const std::vector<NamedSpace>& ownColorspaces();

/// Our space of that name or alias (case does not matter), or null.
const NamedSpace* findOwnColorspace(std::string_view name);
/// Our space with this curve and these primaries, or null.
const NamedSpace* findOwnColorspace(Curve curve, const Primaries& primaries);

/// Roles and the names of our spaces that have them, as the ACES studio configurations assign them.
const std::vector<std::pair<std::string, std::string>>& ownRoles();

}  // namespace virga::io
