// `virga rain --reference`: the settings' shot by src/reference in the place of the GPU, to check the one by the other.
#pragma once

#include <memory>
#include <string>

#include "shot/FrameRenderer.h"
#include "shot/ShotScene.h"

namespace virga::shot {

struct ReferenceOptions {
    /// Every drop between --near and --far, none of them folded into fog; else the drops that the renderer draws, and
    /// the others fog, as there.
    bool allDrops = true;
    int samples = 16;           ///< along the edge of a pixel, 1 to 256
    int widestPanorama = 1024;  ///< wider ones are averaged to that; at 256 drops' light is off by some 0.3 %
    bool plainDrops = false;    ///< round discs in the place of the mattes: what a drop covers, whatever it looks like
};

/// What `--reference` is followed by: nothing or "all", "drawn". Throws Error(InvalidArgument).
bool drawsAllDrops(const std::string& kind);

/// Minutes a frame; opens no device. What it takes from the settings' light is the panorama, integrated over each
/// pixel's direction; panoramas over widestPanorama pixels wide are averaged to that first, and D then over a pixel's
/// height, 0.35 degrees at 1024. What lies behind the fog is the renderer's own low-passed map, which is a part of the
/// model.
class ReferenceRenderer final : public FrameRenderer {
public:
    /// As Compositor. Throws Error(InvalidArgument) naming what the reference does not do: splashes, --paper,
    /// --background-boost, a sequence of panoramas.
    ReferenceRenderer(const Settings& settings, const Shot& shot, const Wanted& wanted, const PlateSamples& samples,
                      const ReferenceOptions& options = {});
    ~ReferenceRenderer() override;

    const FramePlan& plan() const override;
    using FrameRenderer::render;
    io::RenderedFrame render(io::PlateFrame plate, std::shared_ptr<RowSink> canvas) override;
    const CompositorStatistics& statistics() const override;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace virga::shot
