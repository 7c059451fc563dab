// The passes of a frame on the processor, without OpenGL: what a farm node or a laptop without a GPU draws with. The
// same drops and the same formulas as the shaders, eight numbers at a time, and the work of one band of rows, from its
// strokes to the blend, by one thread while its sums are in the cache. A plate that is light is drawn over where it
// lies, and a pixel that no effect reaches is not written; one that is still codes becomes light, is drawn over and
// becomes codes again within the cache, so that light never goes through memory.
//
// Within 1e-5 of the GL passes' picture and layers (tests/passes/cpu_test.cpp): both round as float does, not alike.
#pragma once

#include <glm/mat3x3.hpp>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/Image.h"
#include "core/PictureRows.h"
#include "core/Watch.h"
#include "matte/StrokeAtlas.h"
#include "particles/RainField.h"
#include "passes/Features.h"
#include "passes/SharedFrame.h"

namespace virga::passes {

class CpuRenderer {
public:
    /// atlas: of a rain's strokes; may be empty without rain.
    CpuRenderer(int width, int height, const Features& features, const matte::StrokeAtlas& atlas);
    ~CpuRenderer();

    void resize(int width, int height);
    /// Asked between bands of rows, on the thread that calls render(), which then throws Error(Interrupted).
    void setWatch(const Watch& watch);
    /// As FrameTargets' of the same names. Depth is not copied and must live until the frame is rendered.
    void setDepth(ConstImageViewF depth);
    void setFogTable(const std::vector<float>& opticalDepth);
    void setVeilTable(const std::vector<float>& sums);
    void setLamps(std::span<const shared::PointLight> lamps);
    void setRingTransfer(const std::vector<float>& ringTransfer);
    void setLut(const std::vector<float>& rgb);  ///< constants.lut.z nodes a side
    void setDropRadiance(ConstImageViewF radiance, ConstImageViewF lowPassBackground);

    /// Draws over `picture`, width x height x 4. environmentFromWorld: see LightPass.
    void render(ImageView<float> picture, const shared::FrameConstants& constants, const particles::CellList& cells,
                const glm::mat3& environmentFromWorld = glm::mat3(1.0f));

    /// The same from rows of the plate to rows of the result. Not with features.blur, which wants all of the plate.
    void render(const RowSource& plate, RowSink& result, const shared::FrameConstants& constants,
                const particles::CellList& cells, const glm::mat3& environmentFromWorld = glm::mat3(1.0f));

    // Of the last frame.
    std::size_t strokeCount() const, splashCount() const;
    std::size_t bytes() const;  ///< of the lists, grids and maps that it keeps, its layers, and a thread's sums for each
    const std::map<std::string, double>& passMs() const;      ///< by the names of the GL passes
    ImageF takeRain(), takeSplash(), takeFog(), takePlate();  ///< features.layers
    ImageF takeNearestDepth(), takeNearestMotion();           ///< features.nearest; as FrameTargets'

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace virga::passes
