#include "io/ImageColor.h"

#include <cctype>

#include "core/Words.h"

namespace virga::io {

namespace {

constexpr std::string_view ownNamespace = "virga:";

/// Letters and digits, everything else an underscore.
std::string slugOf(const std::string& name)
{
    std::string slug;
    for (const char c : lowerCase(name)) {
        const bool isWord = std::isalnum(static_cast<unsigned char>(c)) != 0;
        if (isWord || (!slug.empty() && slug.back() != '_')) slug += isWord ? c : '_';
    }
    while (!slug.empty() && slug.back() == '_') slug.pop_back();
    return slug;
}

std::string spaceOfInteropId(const std::string& id)
{
    if (id.starts_with(ownNamespace))
        for (const NamedSpace& space : ownColorspaces())
            if (interopIdOf(space) == id) return space.name;
    return id;
}

/// Profiles are known by what their makers call them: "Display P3", "sRGB IEC61966-2.1", "Adobe RGB (1998)".
std::string spaceOfProfile(const std::string& description)
{
    const std::string text = lowerCase(description);
    const auto says = [&](const char* word) { return text.find(word) != std::string::npos; };
    if (says("linear")) return {};
    if (says("display p3")) return "Display P3";
    if (says("adobe rgb") || says("adobergb")) return "Adobe RGB";
    if (says("srgb")) return "sRGB";
    if (says("2020") && !says("pq") && !says("hlg")) return "Rec.2020";
    if (says("709")) return "Rec.709 camera";
    return {};
}

std::string spaceOfTransfer(const std::string& transfer)
{
    if (transfer == "Linear" || transfer == "scene_linear" || transfer == "lin_srgb") return "Linear Rec.709";
    if (transfer == "KodakLog") return "Cineon";
    if (transfer == "Rec709") return "sRGB";  // display-referred, see ColorSpaces.h
    if (transfer == "AdobeRGB") return "Adobe RGB";
    return transfer;  // a name, perhaps of the user's configuration
}

}  // namespace

std::string interopIdOf(const NamedSpace& space)
{
    return space.interopId.empty() ? std::string(ownNamespace) + slugOf(space.name) : space.interopId;
}

std::vector<ColorClaim> colorClaims(const ImageColorWords& words)
{
    std::vector<ColorClaim> claims;
    if (!words.interopId.empty() && words.interopId != "unknown")
        claims.push_back({spaceOfInteropId(words.interopId), "metadata: colorInteropID " + words.interopId});
    if (words.isAcesContainer) claims.push_back({primaries::ap0.linearName, "metadata: ACES container"});
    if (const std::string space = spaceOfProfile(words.profile); !space.empty())
        claims.push_back({space, "metadata: ICC profile '" + words.profile + "'"});
    if (words.isFloat && words.chromaticities)
        if (const Primaries* known = findPrimaries(*words.chromaticities))
            claims.push_back({known->linearName, "metadata: chromaticities"});
    if (!words.isFloat && !words.transfer.empty())
        claims.push_back({spaceOfTransfer(words.transfer), "metadata: " + words.transfer});

    if (words.isFloat)
        claims.push_back({primaries::rec709.linearName, words.chromaticities
                                                            ? "guess: floating point is linear light, its "
                                                              "chromaticities are none that are known"
                                                            : "guess: floating point is linear light"});
    else if (words.hasProfile)
        claims.push_back({"sRGB", "guess: integer pixels, and an ICC profile that is not known" +
                                      (words.profile.empty() ? "" : ", '" + words.profile + "'")});
    else
        claims.push_back({"sRGB", "guess: integer pixels of a picture"});
    return claims;
}

}  // namespace virga::io
