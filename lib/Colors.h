// Colour spaces of the pictures that come and go, looked up once.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>

#include "io/ColorConversion.h"

namespace virga::lib {

/// Names are those of one configuration. Not for several threads at once.
class Colors {
public:
    using Way = std::shared_ptr<const io::ColorTransform>;

    /// ocio: a configuration's file; empty: $OCIO's, else ours. Opens it when a space is first named. Another one
    /// forgets what was found.
    void use(const std::string& ocio);
    // All throw Error(InvalidArgument) or Error(Input) with `name`, the picture's.

    /// The linear space that pictures of `space` are worked on in; of an empty name Rec.709's.
    std::string working(const std::string& space, const std::string& name);
    /// From a picture's space to its working space, and to a picture's space from `working`. An empty name is
    /// scene-linear: nothing to do.
    Way toLinear(const std::string& space, const std::string& name);
    Way toCodes(const std::string& working, const std::string& space, const std::string& name);

private:
    const io::ColorConfig& config();
    template <class Found>
    static auto named(const std::string& space, const std::string& name, const Found& find);
    Way way(const std::string& from, const std::string& to);

    std::string ocio_;
    std::shared_ptr<const io::ColorConfig> config_;
    std::map<std::pair<std::string, std::string>, Way> ways_;
};

}  // namespace virga::lib
