// Colour spaces by name, and the way from each to the working space: scene-linear light.
//
// Names are looked up in the user's OpenColorIO configuration, if there is one (--ocio, else $OCIO), then among ours
// (ColorSpaces.h), whatever their case: names of spaces, their aliases, and roles. Pictures in a space of ours are
// worked on in linear light of their own primaries; pictures in a space of the user's configuration in its
// scene_linear. Between the two collections the way goes through ACES2065-1, the configuration's role aces_interchange.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "io/ColorSpaces.h"
#include "io/ColorTransform.h"

namespace virga::io {

/// Every name that a user may say, with where it comes from. Never changes once made; safe to use from several threads.
class ColorConfig {
public:
    /// `file`: an OpenColorIO configuration; empty: the one that $OCIO names, else ours alone.
    /// Throws Error(Input) if it is missing, cannot be read or does not hold together.
    static std::shared_ptr<const ColorConfig> open(const std::string& file);

    /// Ours alone, whatever $OCIO says.
    static std::shared_ptr<const ColorConfig> builtIn();

    virtual ~ColorConfig() = default;

    /// "built-in", or the user's file and who named it: "show.ocio (--ocio)", "/cfg/aces.ocio ($OCIO)".
    virtual std::string origin() const = 0;
    /// Whether resolve() would find the name.
    virtual bool knows(const std::string& name) const = 0;
    /// The name as its configuration spells it; of a role or an alias, the space that it stands for. Throws
    /// Error(InvalidArgument) with the nearest names for an unknown one.
    virtual std::string resolve(const std::string& name) const = 0;
    /// The space of ours that is the same: by that name, or, for one of the user's, by what it makes of a few colours
    /// (to 1e-4). Null if there is none, or no role aces_interchange to compare them in. For tags and chromaticities.
    virtual const NamedSpace* equivalent(const std::string& name) const = 0;
    /// What the user's file rules say of this file; empty if there are none or only the default rule matches.
    virtual std::string fromFileRules(const std::string& path) const = 0;
    /// The linear space that pictures of `colorspace` are worked on in. Data stays as it is. Throws Error(Input) if the
    /// user's configuration has no role scene_linear.
    virtual std::string working(const std::string& colorspace) const = 0;
    /// From one named space to another; to and from data nothing changes. Throws Error(InvalidArgument) if a name is
    /// unknown or there is no way between them.
    virtual std::shared_ptr<const ColorTransform> transform(const std::string& from, const std::string& to) const = 0;

    struct Listed {
        std::string name, family;
        std::vector<std::string> aliases;
        bool isUsers;  ///< of the user's configuration
    };
    /// All spaces that resolve() finds, the user's before ours.
    virtual std::vector<Listed> spaces() const = 0;
    /// Roles and the spaces that have them, the user's before ours.
    virtual std::vector<std::pair<std::string, std::string>> roles() const = 0;
};

/// Between two spaces of ours, whatever configuration there is.
std::shared_ptr<const ColorTransform> makeColorTransform(const std::string& from, const std::string& to);

/// Which space a picture is in, and who says so.
struct ColorClaim {
    std::string colorspace;
    std::string source;   ///< "flag", "metadata: ...", "file rules of ...", "guess: ..."
    std::string doubt{};  ///< what the file says that is not known or not supported; for a warning
    bool isGuess() const { return source.starts_with("guess"); }
};

/// The first of: the flag, if it is not empty; what the file itself says; the file rules; the guess.
/// said  by the file, weightiest first; names that nobody knows are passed over. The last is a guess by the file's
/// kind. Warns of a doubt.
ColorClaim chooseColorspace(const ColorConfig& config, const std::string& flag, const std::string& path,
                            const std::vector<ColorClaim>& said);

}  // namespace virga::io
