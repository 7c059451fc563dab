// Sets of primaries and the matrices between them.
#pragma once

#include <array>
#include <vector>

namespace virga::io {

/// How the eye's getting used to another white is modelled. Nothing is adapted between spaces of one white.
enum class Adaptation {
    Bradford,  ///< Lam 1985, as in ICC.1:2010 annex E: what ACES and ICC use for displays, Panasonic and RED for
               ///< cameras
    Cat02,     ///< CIECAM02 (CIE 159:2004): what ACES, ARRI, Sony, Canon and Blackmagic use for the other cameras
};

/// CIE 1931.
struct Chromaticity {
    double x, y;
    bool operator==(const Chromaticity&) const = default;
};

struct Primaries {
    const char* linearName;  ///< the colour space that is linear in these, "Linear Rec.709"
    Chromaticity red, green, blue, white;
    Adaptation adaptation = Adaptation::Bradford;
    bool isXyz = false;  ///< the three values are X, Y, Z themselves, white is not (1, 1, 1)
};

namespace primaries {
extern const Primaries rec709, rec601at525, rec601at625, rec2020, p3d65, p3dci, adobeRgb, ap0, ap1, xyzD65;
extern const Primaries arriWideGamut3, arriWideGamut4, sGamut3, sGamut3Cine, cinemaGamut, vGamut, redWideGamut,
    blackmagicGen5, davinciWideGamut;
}  // namespace primaries

/// All of the above.
const std::vector<const Primaries*>& allPrimaries();

/// Red x, red y, green x, ... white y: the EXR attribute "chromaticities".
std::array<float, 8> chromaticitiesOf(const Primaries& p);
/// Primaries whose chromaticities are all within 0.002 of these, or null.
const Primaries* findPrimaries(const std::array<float, 8>& chromaticities);

using Matrix3 = std::array<std::array<double, 3>, 3>;

/// CIE XYZ of linear light: the primaries in the columns, scaled so that (1, 1, 1) is the white with Y = 1. SMPTE RP
/// 177.
Matrix3 xyzFromRgb(const Primaries& p);

/// Linear light in `from` -> linear light in `to`. White stays white: where the two whites differ, colours are adapted
/// by Cat02 if either set asks for it, else by Bradford.
Matrix3 conversionMatrix(const Primaries& from, const Primaries& to);

}  // namespace virga::io
