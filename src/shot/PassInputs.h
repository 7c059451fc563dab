// A shot's scene as the passes want it: constants, cells, tables and lamps of one frame.
#pragma once

#include <vector>

#include "particles/HiddenCells.h"
#include "passes/SharedFrame.h"
#include "shot/ShotScene.h"

namespace virga::shot {

struct PassInputs : ShotScene {
    using ShotScene::ShotScene;

    /// Fog and veil as functions of depth: entries of frame.glsl's tables.
    struct Tables {
        std::vector<float> fog, veil;
    };
    Tables tablesFor(const particles::Exposure& exposure) const;

    /// tables: of this exposure. lampsInUse: how many setLamps was told.
    shared::FrameConstants constantsFor(const particles::Exposure& exposure, const Tables& tables,
                                        std::size_t lampsInUse) const;

    /// farthest: of the scene's depth; null: nothing is behind anything.
    particles::CellList cellsIn(const particles::Exposure& exposure, const particles::FarthestDepth* farthest,
                                double matteWidthDiameters) const;

    /// Lamps whose light arrives at a drop in view, all of them if that is not looked at. greatestTransfer: of a drop
    /// [1/sr].
    std::vector<SceneLight> seenLamps(const particles::Exposure& exposure, double greatestTransfer_1_sr) const;
    static std::vector<shared::PointLight> fromCamera(const std::vector<SceneLight>& lamps,
                                                      const particles::Exposure& exposure);

private:
    double dropWay(const particles::Exposure& exposure) const;
};

}  // namespace virga::shot
