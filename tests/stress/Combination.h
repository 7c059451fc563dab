// A shot chosen by chance: settings from the whole parameter table, files, camera, plate. Number n of seed s is the
// same shot whichever others are made.
#pragma once

#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "shot/Compositor.h"
#include "shot/Parameters.h"
#include "stress/Laws.h"
#include "support/Files.h"

namespace virga::stress {

struct Combination {
    shot::Settings settings;
    shot::Shot shot;
    FrameNumber frame = 0;
    bool layers = false, isOpaque = true;
    ImageF plate;
    Ceiling ceiling;
    std::string description;  ///< as flags of `virga rain`
};

/// Panoramas, depths, lamps, tracks and atlases that the shots take their pick of.
class Files {
public:
    Files();
    const std::vector<std::string>& of(std::string_view parameter) const;
    /// The largest value of a panorama or lamp file's light.
    double lightOf(const std::string& path) const;

private:
    void makeImage(const std::string& parameter, const std::string& name, const ImageF& pixels,
                   const std::vector<std::string>& channels);
    void makeText(const std::string& parameter, const std::string& name, const std::string& text, double light = 0);

    test::TemporaryFolder folder_;
    std::map<std::string, std::vector<std::string>, std::less<>> files_;
    std::map<std::string, double> light_;
};

/// Shot `number` of `seed`.
Combination combination(std::uint32_t seed, std::uint32_t number, const Files& files);

/// Values outside of a number's range, and words that are none: each must be refused.
std::vector<std::string> valuesBeyond(const shot::Parameter& parameter);

}  // namespace virga::stress
