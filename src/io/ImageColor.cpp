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
    if (lowerCase(transfer) == "linear" || transfer == "scene_linear" || transfer == "lin_srgb")
        return "Linear Rec.709";
    if (transfer == "KodakLog") return "Cineon";
    if (transfer == "Rec709") return "sRGB";  // display-referred, see ColorSpaces.h
    if (transfer == "AdobeRGB") return "Adobe RGB";
    // What sRGB files say for want of a better word (PNG, 2003, 11.3.3.5).
    if (transfer == "Gamma2.2") return "sRGB";
    if (transfer == "Gamma2.6") return "Rec.709 gamma 2.6";
    if (transfer == "Gamma2.8") return "Rec.709 gamma 2.8";
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
    if (words.cicp) claims.push_back(*words.cicp);
    if (words.isAcesContainer) claims.push_back({primaries::ap0.linearName, "metadata: ACES container"});
    if (const std::string space = spaceOfProfile(words.profile); !space.empty())
        claims.push_back({space, "metadata: ICC profile '" + words.profile + "'"});
    if (words.isFloat && words.chromaticities)
        if (const Primaries* known = findPrimaries(*words.chromaticities))
            claims.push_back({known->linearName, "metadata: chromaticities"});
    if (!words.isFloat && !words.transfer.empty())
        claims.push_back({spaceOfTransfer(words.transfer), "metadata: " + words.transfer});

    ColorClaim guess{"sRGB", "guess: integer pixels of a picture"};
    if (words.isFloat) {
        guess = {primaries::rec709.linearName, "guess: floating point is linear light"};
        if (words.chromaticities) guess.doubt = "its chromaticities are of no space that is known";
    } else if (words.hasProfile) {
        guess.doubt = "its ICC profile '" + words.profile + "' is not known";
    } else if (!words.transfer.empty()) {
        guess.doubt = "its transfer '" + words.transfer + "' is not known";
    }
    claims.push_back(guess);
    return claims;
}

}  // namespace virga::io
