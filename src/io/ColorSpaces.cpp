#include "io/ColorSpaces.h"

#include <algorithm>
#include <map>

#include "core/Words.h"

namespace virga::io {

namespace {

/// What a movie's tags can say: every display curve over every set of display primaries. The plain name is the one with
/// the sRGB curve, whose reason is in the header.
void addDisplaySpaces(std::vector<NamedSpace>& spaces)
{
    const struct {
        const char* base;
        const char* plain;
        const Primaries* primaries;
    } bases[] = {{"Rec.709", "sRGB", &primaries::rec709},
                 {"Rec.2020", "Rec.2020", &primaries::rec2020},
                 {"P3-D65", "Display P3", &primaries::p3d65},
                 {"P3-DCI", "P3-DCI", &primaries::p3dci},
                 {"Rec.601 525", "Rec.601 525", &primaries::rec601at525},
                 {"Rec.601 625", "Rec.601 625", &primaries::rec601at625}};
    const std::pair<const char*, Curve> curves[] = {{" BT.1886", Curve::Bt1886},
                                                    {" camera", Curve::Rec709Camera},
                                                    {" gamma 2.2", Curve::Gamma22},
                                                    {" gamma 2.6", Curve::Gamma26},
                                                    {" gamma 2.8", Curve::Gamma28},
                                                    {" PQ", Curve::Pq},
                                                    {" HLG", Curve::Hlg}};
    for (const auto& base : bases) {
        spaces.push_back({base.plain, Curve::Srgb, base.primaries, "display", {}, {}});
        for (const auto& [suffix, curve] : curves)
            spaces.push_back({std::string(base.base) + suffix, curve, base.primaries, "display", {}, {}});
    }
    spaces.push_back({"Adobe RGB", Curve::AdobeRgb, &primaries::adobeRgb, "display", {}, {}});
}

void addCameraSpaces(std::vector<NamedSpace>& spaces)
{
    const struct {
        const char* name;
        Curve curve;
        const Primaries* primaries;
        std::vector<std::string> aliases;
    } cameras[] = {
        {"ARRI LogC3 (EI800)",
         Curve::ArriLogC3,
         &primaries::arriWideGamut3,
         {"arri_logc3_ei800", "logc3", "logc", "arri logc3", "arri logc", "alexa logc",
          "Input - ARRI - V3 LogC (EI800) - Wide Gamut"}},
        {"ARRI LogC4", Curve::ArriLogC4, &primaries::arriWideGamut4, {"arri_logc4", "logc4"}},
        {"S-Log3 S-Gamut3",
         Curve::SLog3,
         &primaries::sGamut3,
         {"slog3_sgamut3", "slog3", "s-log3", "Input - Sony - S-Log3 - S-Gamut3"}},
        {"S-Log3 S-Gamut3.Cine",
         Curve::SLog3,
         &primaries::sGamut3Cine,
         {"slog3_sgamut3cine", "slog3.cine", "Input - Sony - S-Log3 - S-Gamut3.Cine"}},
        {"CanonLog2 CinemaGamut",
         Curve::CanonLog2,
         &primaries::cinemaGamut,
         {"canonlog2_cgamut", "canonlog2", "clog2", "canon log 2", "CanonLog2 CinemaGamut D55",
          "canonlog2_cinemagamut_d55", "Input - Canon - Canon-Log2 - Cinema Gamut Daylight"}},
        {"CanonLog3 CinemaGamut",
         Curve::CanonLog3,
         &primaries::cinemaGamut,
         {"canonlog3_cgamut", "canonlog3", "clog3", "canon log 3", "CanonLog3 CinemaGamut D55",
          "canonlog3_cinemagamut_d55", "Input - Canon - Canon-Log3 - Cinema Gamut Daylight"}},
        {"V-Log V-Gamut",
         Curve::VLog,
         &primaries::vGamut,
         {"vlog_vgamut", "vlog", "v-log", "Input - Panasonic - V-Log - V-Gamut"}},
        {"Log3G10 REDWideGamutRGB",
         Curve::Log3G10,
         &primaries::redWideGamut,
         {"log3g10_rwg", "log3g10", "Input - RED - REDLog3G10 - REDWideGamutRGB"}},
        {"BMDFilm WideGamut Gen5",
         Curve::BmdFilmGen5,
         &primaries::blackmagicGen5,
         {"bmdfilm_widegamut_gen5", "bmdfilm gen5", "blackmagic film gen5", "bmd film gen 5"}},
        {"DaVinci Intermediate WideGamut",
         Curve::DavinciIntermediate,
         &primaries::davinciWideGamut,
         {"davinci_intermediate_widegamut", "davinci intermediate"}},
        {"Cineon", Curve::Cineon, &primaries::rec709, {"kodaklog", "cineon log", "Input - Generic - Cineon"}},
    };
    for (const auto& c : cameras) spaces.push_back({c.name, c.curve, c.primaries, "camera", c.aliases, {}});
}

/// Names of other configurations and what people type, by our name.
const std::map<std::string, std::vector<std::string>>& aliasTable()
{
    static const std::map<std::string, std::vector<std::string>> table = {
        {"sRGB",
         {"rec.709", "rec709", "bt.709", "bt709", "sRGB - Texture", "srgb_tx", "srgb_texture",
          "Utility - sRGB - Texture", "sRGB Encoded Rec.709 (sRGB)", "Input - Generic - sRGB - Texture",
          "sRGB - Display", "srgb_rec709_display"}},
        {"Rec.709 BT.1886",
         {"rec.1886", "rec1886", "bt.1886", "bt1886", "Rec.1886 Rec.709 - Display", "rec1886_rec709_display",
          "Gamma 2.4 Rec.709 - Texture", "g24_rec709", "Gamma 2.4 Encoded Rec.709", "g24_rec709_display"}},
        {"Rec.709 camera", {"Camera Rec.709", "camera_rec709", "Utility - Rec.709 - Camera"}},
        {"Rec.709 gamma 2.2",
         {"Gamma 2.2 Rec.709 - Texture", "g22_rec709", "Gamma 2.2 Encoded Rec.709", "g22_rec709_display"}},
        {"Rec.2020", {"rec2020", "bt.2020", "bt2020"}},
        {"Rec.2020 BT.1886", {"Rec.1886 Rec.2020 - Display", "rec1886_rec2020_display"}},
        {"Rec.2020 PQ",
         {"Rec.2100-PQ", "Rec.2100 PQ", "rec2100_pq", "Rec.2100-PQ - Display", "rec2100_pq_display", "pq", "st2084",
          "smpte2084", "hdr10", "pq_rec2020_display"}},
        {"Rec.2020 HLG",
         {"Rec.2100-HLG", "Rec.2100 HLG", "rec2100_hlg", "Rec.2100-HLG - Display", "rec2100_hlg_display", "hlg",
          "hlg_rec2020_display"}},
        {"Display P3",
         {"displayp3", "display_p3", "Display P3 - Display", "sRGB Encoded P3-D65", "srgb_p3d65",
          "srgb_p3d65_display"}},
        {"P3-D65 gamma 2.6",
         {"p3-d65", "p3d65", "P3-D65 - Display", "p3d65_display", "G2.6-P3-D65", "g26_p3d65_display"}},
        {"P3-D65 PQ", {"ST2084-P3-D65 - Display", "st2084_p3d65_display", "p3d65_pq", "pq_p3d65_display"}},
        {"P3-DCI gamma 2.6", {"dci-p3", "dci p3"}},
        {"Adobe RGB", {"adobergb", "adobe rgb (1998)"}},
        {"Linear Rec.709",
         {"linear", "lin_rec709", "lin_srgb", "Linear Rec.709 (sRGB)", "lin_rec709_srgb", "Utility - Linear - sRGB",
          "Utility - Linear - Rec.709", "linear sRGB"}},
        {"Linear Rec.2020", {"lin_rec2020", "Utility - Linear - Rec.2020"}},
        {"Linear P3-D65", {"lin_p3d65", "lin_displayp3", "Utility - Linear - P3-D65", "linear Display P3"}},
        {"Linear Adobe RGB", {"lin_adobergb", "Linear AdobeRGB"}},
        {"Linear ARRI Wide Gamut 3", {"lin_arri_wide_gamut_3", "Input - ARRI - Linear - ALEXA Wide Gamut"}},
        {"Linear ARRI Wide Gamut 4", {"lin_arri_wide_gamut_4"}},
        {"Linear S-Gamut3", {"lin_sgamut3"}},
        {"Linear S-Gamut3.Cine", {"lin_sgamut3cine"}},
        {"Linear Cinema Gamut", {"lin_cgamut", "Linear CinemaGamut D55", "lin_cinemagamut_d55"}},
        {"Linear V-Gamut", {"lin_vgamut"}},
        {"Linear REDWideGamutRGB", {"lin_rwg", "lin_redwidegamutrgb"}},
        {"Linear BMD WideGamut Gen5", {"lin_bmd_widegamut_gen5"}},
        {"Linear DaVinci WideGamut", {"lin_davinci_widegamut"}},
        {"ACEScg", {"lin_ap1", "ap1", "ACES - ACEScg"}},
        {"ACES2065-1", {"lin_ap0", "ap0", "ACES - ACES2065-1"}},
        {"ACEScct", {"acescct_ap1", "ACES - ACEScct"}},
        {"ACEScc", {"acescc_ap1", "ACES - ACEScc"}},
        {"CIE-XYZ-D65", {"cie_xyz_d65", "xyz"}},
        {"raw", {"data", "utility - raw", "non-color", "noncolor", "linear raw"}},
    };
    return table;
}

/// ASWF Color Interop Forum, "Color Space Encodings for Texture Assets and CG Rendering", 2024.
const std::map<std::string, std::string>& interopIds()
{
    static const std::map<std::string, std::string> ids = {{"ACEScg", "lin_ap1_scene"},
                                                           {"ACES2065-1", "lin_ap0_scene"},
                                                           {"Linear Rec.709", "lin_rec709_scene"},
                                                           {"Linear P3-D65", "lin_p3d65_scene"},
                                                           {"Linear Rec.2020", "lin_rec2020_scene"},
                                                           {"Linear Adobe RGB", "lin_adobergb_scene"},
                                                           {"CIE-XYZ-D65", "lin_ciexyzd65_scene"},
                                                           {"sRGB", "srgb_rec709_scene"},
                                                           {"Rec.709 gamma 2.2", "g22_rec709_scene"},
                                                           {"Display P3", "srgb_p3d65_scene"},
                                                           {"Adobe RGB", "g22_adobergb_scene"},
                                                           {"raw", "data"}};
    return ids;
}

std::vector<NamedSpace> makeSpaces()
{
    using namespace primaries;
    std::vector<NamedSpace> spaces;
    for (const auto& [name, curve, p] : {std::tuple{"ACES2065-1", Curve::Linear, &ap0},
                                         {"ACEScg", Curve::Linear, &ap1},
                                         {"ACEScct", Curve::AcesCct, &ap1},
                                         {"ACEScc", Curve::AcesCc, &ap1}})
        spaces.push_back({name, curve, p, "ACES", {}, {}});
    addDisplaySpaces(spaces);
    addCameraSpaces(spaces);
    for (const Primaries* p : allPrimaries())
        if (p != &ap0 && p != &ap1)
            spaces.push_back({p->linearName, Curve::Linear, p, p->isXyz ? "utility" : "linear", {}, {}});
    spaces.push_back({"raw", Curve::Linear, nullptr, "utility", {}, {}});
    for (NamedSpace& space : spaces) {
        if (const auto found = aliasTable().find(space.name); found != aliasTable().end())
            space.aliases.insert(space.aliases.end(), found->second.begin(), found->second.end());
        if (const auto found = interopIds().find(space.name); found != interopIds().end())
            space.interopId = found->second;
    }
    return spaces;
}

}  // namespace

const std::vector<NamedSpace>& ownColorspaces()
{
    static const std::vector<NamedSpace> spaces = makeSpaces();
    return spaces;
}

const NamedSpace* findOwnColorspace(std::string_view name)
{
    static const std::map<std::string, const NamedSpace*> byName = [] {
        std::map<std::string, const NamedSpace*> result;
        for (const NamedSpace& space : ownColorspaces()) {
            result.emplace(lowerCase(space.name), &space);
            for (const std::string& alias : space.aliases) result.emplace(lowerCase(alias), &space);
            if (!space.interopId.empty()) result.emplace(space.interopId, &space);
        }
        return result;
    }();
    const auto found = byName.find(lowerCase(name));
    return found == byName.end() ? nullptr : found->second;
}

const NamedSpace* findOwnColorspace(Curve curve, const Primaries& primaries)
{
    for (const NamedSpace& space : ownColorspaces())
        if (space.primaries == &primaries && space.curve == curve) return &space;
    return nullptr;
}

const std::vector<std::pair<std::string, std::string>>& ownRoles()
{
    static const std::vector<std::pair<std::string, std::string>> roles = {{"aces_interchange", "ACES2065-1"},
                                                                           {"cie_xyz_d65_interchange", "CIE-XYZ-D65"},
                                                                           {"color_picking", "sRGB"},
                                                                           {"color_timing", "ACEScct"},
                                                                           {"compositing_linear", "ACEScg"},
                                                                           {"compositing_log", "ACEScct"},
                                                                           {"data", "raw"},
                                                                           {"default", "raw"},
                                                                           {"matte_paint", "sRGB"},
                                                                           {"reference", "ACES2065-1"},
                                                                           {"rendering", "ACEScg"},
                                                                           {"scene_linear", "ACEScg"},
                                                                           {"texture_paint", "ACEScct"}};
    return roles;
}

}  // namespace virga::io
