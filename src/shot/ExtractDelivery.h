// What `virga extract` leaves in its folder: mattes, footage without rain, plate, atlas, sheet, report.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "matte/CutAtlas.h"
#include "matte/FrameAlignment.h"
#include "matte/RainExtraction.h"
#include "shot/ExtractFootage.h"

namespace virga::shot {

class ExtractDelivery {
public:
    /// Checks the names before there is work to lose. Throws Error(Output).
    ExtractDelivery(const ExtractJobOptions& job, ExtractFootage& footage);
    ~ExtractDelivery();

    /// What the whole clip is delivered in. Colours in the values of the model: `color` is the C that it is solved
    /// with, `shown` the one that mattes are made for. They differ where light was added, which has no C: solved with
    /// one far beyond white, mattes would be next to nothing.
    void setModel(ModelSpace space, const std::array<float, 3>& color, const std::array<float, 3>& shown);

    /// Whether it rains at all: strokes that are brighter than the scene, or alpha at large that has a direction,
    /// against those that are darker, of which rain makes none. Where it does not, alphas are 0 and the frames stay as
    /// they are. areDelivered: deliver() is called with this solution, and no camera moves.
    void judge(std::span<const ImageF> frames, const matte::Extraction& found, bool areDelivered);
    bool rains() const { return rains_; }

    /// The scene that clean.exr shows.
    void keepPlate(const matte::Extraction& found);
    const ImageF& plateInModel() const { return plate_; }

    /// A solved window. places: of a camera that moved (FrameAlignment.h), or empty; the frames of the window then
    /// still have their breathing exposure.
    struct Solution {
        std::vector<FrameNumber> numbers;
        matte::Extraction found;
        std::vector<matte::FrameAlignment> places;
    };

    /// Frames [from, to) of a window, whose alphas in `solution` become those that are delivered. The first `fade` of
    /// them go over from what the solution before has of them, if it does. tell(number) after each; false ends it and
    /// is returned.
    bool deliver(const FootageWindow& window, Solution& solution, std::size_t from, std::size_t to,
                 const Solution* before, std::size_t fade, const std::function<bool(FrameNumber)>& tell);

    /// Plate, atlas, sheet.
    void finish();

    /// "footage", "rain", "atlas", "match", "files", "repaired", "seconds".
    nlohmann::json report() const;
    void writeReport(const nlohmann::json& report) const;

private:
    struct Delivered;

    std::string path(const std::string& name) const;
    bool writesHalf() const;
    Delivered prepare(ImageF frame, const ImageF* coverage, const Solution& solution, std::size_t k) const;
    ImageF toLinearAlpha(const ImageF& alpha, const ImageF& scene) const;
    matte::RainStrokeOptions strokeOptions(const matte::Extraction& found) const;
    void addEstimate(nlohmann::json& rain, nlohmann::json& match) const;
    void gather(matte::Extraction& found, std::size_t from, std::size_t count);
    void makeAtlas();

    const ExtractJobOptions& job_;
    ExtractFootage& footage_;
    std::unique_ptr<io::PlateWriter> clean_;
    ModelSpace space_ = ModelSpace::Linear;
    std::array<float, 3> color_{};        // in the values of the model
    std::array<float, 3> linearColor_{};  // `shown`, in linear light
    bool isRecoloured_ = false;
    bool rains_ = true;
    int brightStrokes_ = 0, darkStrokes_ = 0;
    double brightMass_ = 0, darkMass_ = 0;
    std::map<std::size_t, std::vector<matte::RainStroke>> judged_;  // of alphas that will be delivered as they are
    ImageF plate_;                                                  // in the values of the model
    ImageF linearPlate_;                                            // RGB, once it is written
    ImageF confidence_;                                             // of the survey
    std::vector<FrameNumber> delivered_;
    std::vector<matte::RainStroke> strokes_;  // of the frames whose strokes are counted
    std::size_t countedFrames_ = 0;
    std::vector<matte::KeptStroke> best_;
    std::optional<matte::StrokeAtlas> atlas_;
    double minContrast_ = 0.01;  // of the strokes that are counted
    ImageF sheetFrame_, sheetAlpha_, sheetClean_;
    double wetSamples_ = 0, samples_ = 0, confident_ = 0;
    std::map<std::string, double> seconds_;
};

}  // namespace virga::shot
