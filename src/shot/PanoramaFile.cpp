#include "shot/PanoramaFile.h"

#include "core/Log.h"
#include "environment/Highlights.h"
#include "io/ImageFile.h"
#include "io/Plate.h"

namespace virga::shot {

void PanoramaSaid::log() const
{
    for (const std::string& sentence : warnings) virga::log::warning("{}", sentence);
    for (const std::string& sentence : notes) virga::log::info("{}", sentence);
}

environment::Panorama readPanorama(const std::string& path, std::optional<double> lightRadiance,
                                   environment::PanoramaReport* report, const std::string& ocio, PanoramaSaid* said)
{
    environment::PanoramaReport found;
    environment::Panorama panorama = environment::preparePanorama(io::readLinearImage(path, {}, ocio), path, &found);
    PanoramaSaid sentences{found.said, {}};
    sentences.log();  // before what may fail
    const bool endsAtWhite = !io::readImageHeader(path).isFloat;
    const environment::HighlightReport highlights =
        environment::repairHighlights(panorama, path, {.lightRadiance = lightRadiance, .endsAtWhite = endsAtWhite});
    PanoramaSaid{{}, highlights.said}.log();
    sentences.notes = highlights.said;
    if (said) *said = std::move(sentences);
    if (report) *report = std::move(found);
    return panorama;
}

}  // namespace virga::shot
