// A shot's scene with the renderer that draws it, which is told what has changed and nothing else.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "shot/Compositor.h"
#include "shot/PassInputs.h"
#include "shot/PictureRenderer.h"

namespace virga::shot {

struct ScenePictures : PassInputs {
    ScenePictures(const Settings& settings, const Shot& shot, const CompositorOptions& options,
                  const PlateSamples& samples)
        : PassInputs(settings, shot, options.wanted, samples, KeptFiles(options.cacheFolder)), options(options)
    {
    }

    /// After those parts of the scene have been made: a renderer for them, unless the one that is there will do. Throws
    /// Error; then the one that is there stays.
    void prepare(unsigned parts);
    /// The renderer may have been told anything.
    void forgetWhatIsTold();

    ViewWindows windowsFor(const View& view) const;
    bool needsWholePlate() const;

    // Before a frame is drawn, in this order.
    bool look(double scale, const Window& drawn);  ///< true: as at the frame before
    void setDepth(FrameNumber frame, const particles::Exposure& exposure, ConstImageViewF plate, bool isSamePlate);
    void setTables(const particles::Exposure& exposure);
    void setLamps(const particles::Exposure& exposure);
    void setLight(const io::PlateFrame& plate, const ViewWindows& windows, bool isSamePlate);

    /// Empty if the plate is a part of it.
    static ConstImageViewF wholeFrameIn(const io::PlateFrame& plate, const ViewWindows& windows);

    const CompositorOptions options;
    CompositorStatistics statistics;
    std::unique_ptr<PictureRenderer> renderer;
    std::shared_ptr<const matte::StrokeAtlas> atlas;

    // What the renderer has been told.
    Window drawn;
    std::shared_ptr<const depth::Depth> usedDepth;
    std::optional<particles::FarthestDepth> farthestDepth;  // of usedDepth
    Tables tables;
    std::size_t lampsInUse = 0;
    std::uint64_t lastContent = 0;  // of the plate frame that was rendered last; 0: it came to nothing, or nobody knows

private:
    void leaveOutLamps();

    passes::Features madeFor_;         // the renderer
    std::vector<float> ringTransfer_;  // features.lights
    double greatestTransfer_ = 0;      // of ringTransfer_ [1/sr]
    double scale_ = 1;
    double tablesFocal_ = -1;  // focal length that the tables were made for [px]
    bool hasLight_ = false;
};

}  // namespace virga::shot
