#pragma once

#include <optional>
#include <string>

#include "environment/Panorama.h"

namespace virga::shot {

/// Sentences about a panorama.
struct PanoramaSaid {
    std::vector<std::string> warnings, notes;
    void log() const;
};

/// The panorama of a file, as drops see it: checked and repaired, its lights put back if it is of integers, which end
/// at white, and cut them off. What was found and done is said in the log, and given as `said`. lightRadiance  of
/// lights that are cut off; nothing: estimated ocio           OpenColorIO configuration; empty: $OCIO's, else the
/// built-in one Throws Error(Input) naming the file.
environment::Panorama readPanorama(const std::string& path, std::optional<double> lightRadiance = std::nullopt,
                                   environment::PanoramaReport* report = nullptr, const std::string& ocio = {},
                                   PanoramaSaid* said = nullptr);

/// The same of a picture that is in memory. endsAtWhite: it is of integers.
environment::Panorama repairedPanorama(ConstImageViewF image, const std::string& name, bool endsAtWhite,
                                       std::optional<double> lightRadiance, environment::PanoramaReport* report,
                                       PanoramaSaid* said);

}  // namespace virga::shot
