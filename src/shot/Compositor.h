// Runs the passes of a shot in order: a plate frame in, the finished frame and its layers out.
#pragma once

#include <memory>
#include <string>

#include "core/Timeline.h"
#include "shot/FrameRenderer.h"
#include "shot/ShotScene.h"
#include "shot/View.h"

namespace virga::shot {

struct CompositorOptions {
    Wanted wanted{};
    std::string device = "auto";   ///< see makePictureRenderer
    std::string shaderFolder{};    ///< see gl::loadShader
    Timeline* timeline = nullptr;  ///< gets what render() does; must outlive the compositor
    bool changes = false;          ///< change() will be called: what it needs is kept
    std::string cacheFolder{};     ///< where shaders and light are kept for the next time (KeptFiles); empty: nowhere
};

/// Belongs to the thread that made it. A frame depends on (settings, samples, frame number, plate frame) alone.
class Compositor final : public FrameRenderer {
public:
    /// Reads track, mattes, environment and stills, makes the plan and, unless it is a pass-through, opens the device.
    /// samples: a few frames of the plate for its light and the colour transfer. Without those for the light each frame
    /// is lit by itself; without those for the colour transfer there must be none.
    /// Throws Error naming the setting or file.
    Compositor(const Settings& settings, const Shot& shot, const CompositorOptions& options,
               const PlateSamples& samples);
    ~Compositor() override;

    const FramePlan& plan() const override;
    using FrameRenderer::render;
    io::RenderedFrame render(io::PlateFrame plate, std::shared_ptr<RowSink> canvas) override;
    /// Of a view: plate.pixels has what of the plate view.plate says, at the view's scale; beauty and layers are the
    /// region. Throws Error(Interrupted) once the watch, which may be empty, says false; the next frame is as ever.
    io::RenderedFrame render(io::PlateFrame plate, const View& view, const Watch& watch);
    /// What of the plate render() needs for the view: the region, and around it as far as a blur reaches.
    Window plateNeededFor(const View& view) const;
    /// Whether it needs all of the plate for every region: its light comes from it, or a smaller depth's edges.
    bool needsWholePlate() const;
    /// Other settings from the next frame on. What does not depend on those that changed stays: wind leaves the light,
    /// darkening the drops (Dependencies.h). If it throws, the settings are as they were. Needs
    /// CompositorOptions::changes.
    void change(const Settings& settings);

    bool takesRows() const override;
    std::size_t framesInFlight() const override;
    void complete() override;
    const CompositorStatistics& statistics() const override;
    double expectedStrokes() const override;
    bool drawsByShaders() const override;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace virga::shot
