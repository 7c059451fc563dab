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
    const ImageF image = io::readLinearImage(path, {}, ocio);
    return repairedPanorama(image, path, !io::readImageHeader(path).isFloat, lightRadiance, report, said);
}

environment::Panorama repairedPanorama(ConstImageViewF image, const std::string& name, bool endsAtWhite,
                                       std::optional<double> lightRadiance, environment::PanoramaReport* report,
                                       PanoramaSaid* said)
{
    environment::PanoramaReport found;
    environment::Panorama panorama = environment::preparePanorama(image, name, &found);
    PanoramaSaid sentences{found.said, {}};
    sentences.log();  // before what may fail
    const environment::HighlightReport highlights =
        environment::repairHighlights(panorama, name, {.lightRadiance = lightRadiance, .endsAtWhite = endsAtWhite});
    PanoramaSaid{{}, highlights.said}.log();
    sentences.notes = highlights.said;
    if (said) *said = std::move(sentences);
    if (report) *report = std::move(found);
    return panorama;
}

}  // namespace virga::shot
