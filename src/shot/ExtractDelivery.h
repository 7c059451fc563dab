// What `virga extract` leaves in its folder: mattes, footage without rain, plate, atlas, sheet, report.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "matte/FrameAlignment.h"
#include "matte/RainExtraction.h"
#include "shot/ExtractFootage.h"
#include "shot/RainFindings.h"

namespace virga::shot {

class ExtractDelivery {
public:
    /// Checks the names before there is work to lose. Throws Error(Output).
    ExtractDelivery(const ExtractJobOptions& job, ExtractFootage& footage);
    ~ExtractDelivery();

    /// What the whole clip is delivered in.
    void setModel(const MatteModel& model) { model_ = model; }

    /// Whether it rains at all (RainFindings.h). Where it does not, alphas are 0 and the frames stay as they are.
    void judge(std::span<const ImageF> frames, const matte::Extraction& found, bool areDelivered)
    {
        findings_.judge(frames, found, model_, areDelivered);
    }
    bool rains() const { return findings_.rains(); }

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
    void writeAtlas() const;

    const ExtractJobOptions& job_;
    ExtractFootage& footage_;
    std::unique_ptr<io::PlateWriter> clean_;
    MatteModel model_;
    RainFindings findings_;
    ImageF plate_;        // in the values of the model
    ImageF linearPlate_;  // RGB, once it is written
    ImageF confidence_;   // of the survey
    std::vector<FrameNumber> delivered_;
    ImageF sheetFrame_, sheetAlpha_, sheetClean_;
    double wetSamples_ = 0, samples_ = 0, confident_ = 0;
    std::map<std::string, double> seconds_;
};

}  // namespace virga::shot
