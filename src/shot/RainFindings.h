// What is found of the rain in the mattes of `virga extract`: whether it rains, its strokes, the best of them as an
// atlas, and the rain that would make such strokes.
#pragma once

#include <cstddef>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <vector>

#include "io/Plate.h"
#include "matte/CutAtlas.h"
#include "matte/RainExtraction.h"
#include "shot/ExtractJob.h"
#include "shot/MatteModel.h"

namespace virga::shot {

class RainFindings {
public:
    explicit RainFindings(const ExtractJobOptions& job) : job_(job) {}

    /// Whether it rains at all: strokes that are brighter than the scene, or alpha at large that has a direction,
    /// against those that are darker, of which rain makes none. areDelivered: gather() will be called for the alphas of
    /// this solution, in linear light and otherwise unchanged.
    void judge(std::span<const ImageF> frames, const matte::Extraction& found, const MatteModel& model,
               bool areDelivered);
    bool rains() const { return rains_; }

    /// Strokes for the statistics and the best of them for the atlas, of `count` alphas of the solution, which are
    /// delivered: in linear light. As many of them are searched as it takes to find enough.
    void gather(const matte::Extraction& found, const MatteModel& model, std::size_t from, std::size_t count);

    /// Of what has been gathered; nothing if there is no stroke.
    void makeAtlas();
    const matte::StrokeAtlas* atlas() const { return atlas_ ? &*atlas_ : nullptr; }

    /// What the strokes say: adds to "rain", with its uncertainty, and sets "match", settings of `virga rain`.
    /// plate: linear RGB, whose light the drops return.
    void report(const io::PlateInfo& footage, const MatteModel& model, const ImageF& plate, nlohmann::json& rain,
                nlohmann::json& match) const;

private:
    void addEstimate(const io::PlateInfo& footage, const MatteModel& model, const ImageF& plate, nlohmann::json& rain,
                     nlohmann::json& match) const;

    const ExtractJobOptions& job_;
    bool rains_ = true;
    int brightStrokes_ = 0, darkStrokes_ = 0;
    double brightMass_ = 0, darkMass_ = 0;
    std::map<std::size_t, std::vector<matte::RainStroke>> judged_;  // of alphas that will be gathered as they are
    std::vector<matte::RainStroke> strokes_;                        // of the frames whose strokes are counted
    std::size_t countedFrames_ = 0;
    std::vector<matte::KeptStroke> best_;
    std::optional<matte::StrokeAtlas> atlas_;
    double minContrast_ = 0.01;  // of the strokes that are counted
};

}  // namespace virga::shot
