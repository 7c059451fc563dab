// What drops make of a panorama, kept for the next run: reading, checking and convolving one takes most of a second.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "core/KeptFiles.h"
#include "environment/DropRadiance.h"
#include "shot/PanoramaFile.h"
#include "shot/Settings.h"

namespace virga::shot {

struct KeptLight {
    environment::DropRadiance light;  ///< without `response`, which no picture needs; --env-gain not in it
    int width = 0, height = 0;        ///< of the panorama
    PanoramaSaid said;
};

/// All that the light depends on: the file's content, and the settings that go into it. Empty if the file cannot be
/// read, or if colour is managed by a configuration of the user's ($OCIO, --ocio), whose own files are not looked into.
std::string keptLightKey(const std::string& path, const environment::DropRadianceOptions& options,
                         const Settings& settings);

/// The same of a panorama in memory, under the name that sentences call it.
std::string keptLightKey(const ImageF& panorama, const std::string& name,
                         const environment::DropRadianceOptions& options, const Settings& settings);
/// The same of what is made of views of the plate; --env-gain counts, as it is in that.
std::string keptLightKey(std::span<const environment::PlateView> views, const environment::DropRadianceOptions& options,
                         const Settings& settings);

/// Nothing if the key is empty, or nothing whole is kept under it.
std::optional<KeptLight> loadLight(const KeptFiles& files, const std::string& key);
/// Nothing happens if the key is empty.
void storeLight(const KeptFiles& files, const std::string& key, const KeptLight& light);

}  // namespace virga::shot
