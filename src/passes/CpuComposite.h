#pragma once

#include "passes/CpuFrame.h"

namespace virga::passes::cpu {

/// Where the layers of a frame go; empty images where nobody wants them.
struct LayerImages {
    ImageF rain, splash, fog, plate;
};

/// Fog, splashes and rain over the graded plate, in place, in some rows of the band: `rows` are those from `firstRow`
/// on. Twin of pass_composite.comp. A pixel that no effect reaches is not written.
void compositeRows(const Frame& frame, const BandSums& band, int firstRow, ImageView<float> rows, LayerImages& layers);

/// Light of drops (and of the smooth background) at the nodes of the light grid. Twin of pass_light.comp.
void fillLightGrid(Frame& frame, ConstImageViewF dropRadiance, ConstImageViewF lowPassBackground,
                   const glm::mat3& environmentFromWorld);

}  // namespace virga::passes::cpu
