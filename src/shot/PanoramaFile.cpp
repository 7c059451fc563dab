#include "shot/PanoramaFile.h"

#include "core/Log.h"
#include "environment/Highlights.h"
#include "io/ImageFile.h"
#include "io/Plate.h"

namespace virga::shot {

environment::Panorama readPanorama(const std::string& path, std::optional<double> lightRadiance,
                                   environment::PanoramaReport* report, const std::string& ocio)
{
    environment::PanoramaReport found;
    environment::Panorama panorama = environment::preparePanorama(io::readLinearImage(path, {}, ocio), path, &found);
    for (const std::string& sentence : found.said) log::warning("{}", sentence);
    const bool endsAtWhite = !io::readImageHeader(path).isFloat;
    const environment::HighlightReport highlights =
        environment::repairHighlights(panorama, path, {.lightRadiance = lightRadiance, .endsAtWhite = endsAtWhite});
    for (const std::string& sentence : highlights.said) log::info("{}", sentence);
    if (report) *report = std::move(found);
    return panorama;
}

}  // namespace virga::shot
