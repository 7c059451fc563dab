#include "io/Primaries.h"

#include <algorithm>
#include <cmath>

namespace virga::io {

namespace primaries {

constexpr Chromaticity d65{0.3127, 0.3290}, acesWhite{0.32168, 0.33767};

// ITU-R BT.709, BT.601 (525 and 625 lines), BT.2020.
const Primaries rec709{"Linear Rec.709", {0.640, 0.330}, {0.300, 0.600}, {0.150, 0.060}, d65};
const Primaries rec601at525{"Linear Rec.601 525", {0.630, 0.340}, {0.310, 0.595}, {0.155, 0.070}, d65};
const Primaries rec601at625{"Linear Rec.601 625", {0.640, 0.330}, {0.290, 0.600}, {0.150, 0.060}, d65};
const Primaries rec2020{"Linear Rec.2020", {0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, d65};
// SMPTE EG 432-1 and RP 431-2.
const Primaries p3d65{"Linear P3-D65", {0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, d65};
const Primaries p3dci{"Linear P3-DCI", {0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, {0.314, 0.351}};
// Adobe RGB (1998) colour image encoding, version 2005-05.
const Primaries adobeRgb{"Linear Adobe RGB", {0.640, 0.330}, {0.210, 0.710}, {0.150, 0.060}, d65};
// AMPAS TB-2014-004 and S-2014-004.
const Primaries ap0{"ACES2065-1", {0.7347, 0.2653}, {0.0, 1.0}, {0.0001, -0.0770}, acesWhite};
const Primaries ap1{"ACEScg", {0.713, 0.293}, {0.165, 0.830}, {0.128, 0.044}, acesWhite};
const Primaries xyzD65{"CIE-XYZ-D65", {1, 0}, {0, 1}, {0, 0}, d65, Adaptation::Bradford, true};
// ARRI "ALEXA Log C Curve", 2017; "ARRI LogC4", 2022.
const Primaries arriWideGamut3{"Linear ARRI Wide Gamut 3", {0.6840, 0.3130}, {0.2210, 0.8480}, {0.0861, -0.1020}, d65,
                               Adaptation::Cat02};
const Primaries arriWideGamut4{"Linear ARRI Wide Gamut 4", {0.7347, 0.2653}, {0.1424, 0.8576}, {0.0991, -0.0308}, d65,
                               Adaptation::Cat02};
// Sony "Technical Summary for S-Gamut3.Cine/S-Log3 and S-Gamut3/S-Log3".
const Primaries sGamut3{"Linear S-Gamut3", {0.730, 0.280}, {0.140, 0.855}, {0.100, -0.050}, d65, Adaptation::Cat02};
const Primaries sGamut3Cine{"Linear S-Gamut3.Cine", {0.766, 0.275}, {0.225, 0.800}, {0.089, -0.087}, d65,
                            Adaptation::Cat02};
// Canon "Canon Log Gamma Curves", 2018.
const Primaries cinemaGamut{"Linear Cinema Gamut", {0.740, 0.270}, {0.170, 1.140}, {0.080, -0.100}, d65,
                            Adaptation::Cat02};
// Panasonic "V-Log/V-Gamut Reference Manual", 2014.
const Primaries vGamut{"Linear V-Gamut", {0.730, 0.280}, {0.165, 0.840}, {0.100, -0.030}, d65};
// RED "White Paper on REDWideGamutRGB and Log3G10", 2017.
const Primaries redWideGamut{
    "Linear REDWideGamutRGB", {0.780308, 0.304253}, {0.121595, 1.493994}, {0.095612, -0.084589}, d65};
// Blackmagic "Generation 5 Color Science", 2021; "DaVinci Resolve 17: Wide Gamut Intermediate", 2021.
const Primaries blackmagicGen5{"Linear BMD WideGamut Gen5", {0.7177215, 0.3171181}, {0.2280410, 0.8615690},
                               {0.1005841, -0.0820452},     {0.3127170, 0.3290312}, Adaptation::Cat02};
const Primaries davinciWideGamut{"Linear DaVinci WideGamut", {0.8000, 0.3130}, {0.1682, 0.9877}, {0.0790, -0.1155}, d65,
                                 Adaptation::Cat02};

}  // namespace primaries

namespace {

using Vector3 = std::array<double, 3>;

Vector3 multiply(const Matrix3& m, const Vector3& v)
{
    Vector3 result{};
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t k = 0; k < 3; ++k) result[i] += m[i][k] * v[k];
    return result;
}

Matrix3 multiply(const Matrix3& a, const Matrix3& b)
{
    Matrix3 result{};
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
            for (std::size_t k = 0; k < 3; ++k) result[i][j] += a[i][k] * b[k][j];
    return result;
}

Matrix3 inverse(const Matrix3& m)
{
    Matrix3 result{};
    double determinant = 0;
    for (std::size_t i = 0; i < 3; ++i)
        determinant += m[0][i] * (m[1][(i + 1) % 3] * m[2][(i + 2) % 3] - m[1][(i + 2) % 3] * m[2][(i + 1) % 3]);
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
            result[j][i] = (m[(i + 1) % 3][(j + 1) % 3] * m[(i + 2) % 3][(j + 2) % 3] -
                            m[(i + 1) % 3][(j + 2) % 3] * m[(i + 2) % 3][(j + 1) % 3]) /
                           determinant;
    return result;
}

Vector3 xyzOfWhite(const Primaries& p) { return {p.white.x / p.white.y, 1, (1 - p.white.x - p.white.y) / p.white.y}; }

/// XYZ under one white -> XYZ that look the same under the other.
Matrix3 adaptationMatrix(const Primaries& from, const Primaries& to)
{
    static constexpr Matrix3 bradford{
        {{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};
    static constexpr Matrix3 cat02{{{0.7328, 0.4296, -0.1624}, {-0.7036, 1.6975, 0.0061}, {0.0030, 0.0136, 0.9834}}};
    const bool isCat02 = from.adaptation == Adaptation::Cat02 || to.adaptation == Adaptation::Cat02;
    const Matrix3& cones = isCat02 ? cat02 : bradford;
    const Vector3 before = multiply(cones, xyzOfWhite(from)), after = multiply(cones, xyzOfWhite(to));
    Matrix3 scaled = cones;
    for (std::size_t i = 0; i < 3; ++i)
        for (double& value : scaled[i]) value *= after[i] / before[i];
    return multiply(inverse(cones), scaled);
}

}  // namespace

const std::vector<const Primaries*>& allPrimaries()
{
    using namespace primaries;
    static const std::vector<const Primaries*> all = {
        &rec709,      &rec601at525, &rec601at625,  &rec2020,        &p3d65,           &p3dci,   &adobeRgb,
        &ap1,         &ap0,         &xyzD65,       &arriWideGamut3, &arriWideGamut4,  &sGamut3, &sGamut3Cine,
        &cinemaGamut, &vGamut,      &redWideGamut, &blackmagicGen5, &davinciWideGamut};
    return all;
}

std::array<float, 8> chromaticitiesOf(const Primaries& p)
{
    std::array<float, 8> values{};
    std::size_t i = 0;
    for (const Chromaticity& corner : {p.red, p.green, p.blue, p.white}) {
        values[i++] = float(corner.x);
        values[i++] = float(corner.y);
    }
    return values;
}

const Primaries* findPrimaries(const std::array<float, 8>& chromaticities)
{
    for (const Primaries* p : allPrimaries()) {
        const auto near = [](float a, float b) { return std::fabs(a - b) < 0.002f; };
        const std::array<float, 8> own = chromaticitiesOf(*p);
        if (!p->isXyz && std::equal(own.begin(), own.end(), chromaticities.begin(), near)) return p;
    }
    return nullptr;
}

Matrix3 xyzFromRgb(const Primaries& p)
{
    if (p.isXyz) return {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    const Chromaticity corners[3] = {p.red, p.green, p.blue};
    Matrix3 m{};
    for (std::size_t i = 0; i < 3; ++i) {
        m[0][i] = corners[i].x;
        m[1][i] = corners[i].y;
        m[2][i] = 1 - corners[i].x - corners[i].y;
    }
    const Vector3 share = multiply(inverse(m), xyzOfWhite(p));
    for (auto& row : m)
        for (std::size_t i = 0; i < 3; ++i) row[i] *= share[i];
    return m;
}

Matrix3 conversionMatrix(const Primaries& from, const Primaries& to)
{
    Matrix3 xyz = xyzFromRgb(from);
    if (from.white != to.white) xyz = multiply(adaptationMatrix(from, to), xyz);
    return multiply(inverse(xyzFromRgb(to)), xyz);
}

}  // namespace virga::io
