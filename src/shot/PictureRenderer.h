// What draws the frames of a shot: the passes' shaders, or the processor without OpenGL.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/Image.h"
#include "core/PictureRows.h"
#include "core/Watch.h"
#include "grade/ColorTransfer.h"
#include "matte/StrokeAtlas.h"
#include "particles/RainField.h"
#include "passes/Features.h"
#include "passes/SharedFrame.h"

namespace virga::shot {

/// What a renderer is made for. References need live until it is made only.
struct PictureSetup {
    int width = 0, height = 0;
    passes::Features features;  ///< but for `software`
    const matte::StrokeAtlas& atlas;
    const grade::ColorLut& lut;
    const std::vector<float>& ringTransfer;  ///< see ringTransferTable; may be empty without lamps
    std::string device = "auto";             ///< see makePictureRenderer
    std::string shaderFolder{};              ///< see gl::loadShader; with one the shaders draw
    std::string cacheFolder{};               ///< see KeptFiles; empty: programs are compiled each time
};

/// What is drawn over, finite RGBA: an image, or rows that are made when they are asked for. Where the result goes:
/// onto `canvas`, as it must with rows, or into DrawnPicture::beauty.
struct PlateInput {
    ImageF pixels;
    std::shared_ptr<const RowSource> rows;
    std::shared_ptr<RowSink> canvas;
};

/// A finished picture and what its features name beside it; the others are empty.
struct DrawnPicture {
    ImageF beauty;
    ImageF rain, splash, fog, plate;
    ImageF nearestDepth, nearestMotion;
    std::size_t strokes = 0, splashes = 0;
    std::map<std::string, double> passMs;
};

/// Belongs to the thread that made it. What is set stays for the frames to come.
class PictureRenderer {
public:
    virtual ~PictureRenderer() = default;
    /// For the report: GL_RENDERER, or the processor.
    virtual std::string device() const = 0;
    virtual bool isOpenGl() const = 0;
    /// Of the pictures to come. What depends on the size, depth and the plate to keep, is forgotten; the rest stays.
    virtual void resize(int width, int height) = 0;

    /// What it holds of its own after a frame: on the device, if that is one, without the pictures that it gave away.
    virtual std::size_t bytes() const = 0;
    virtual void keepPlate() = 0;  ///< the next frame's plate has the pixels of the last one's
    /// Whether PlateInput may have rows, and a canvas.
    virtual bool takesRows() const { return false; }

    virtual void setDepth(ConstImageViewF metres) = 0;  ///< must live until the next is set
    virtual void setFogTable(const std::vector<float>& opticalDepth) = 0;
    virtual void setVeilTable(const std::vector<float>& sums) = 0;
    virtual void setLamps(std::span<const shared::PointLight> lamps) = 0;
    virtual void setDropRadiance(ConstImageViewF radiance, ConstImageViewF lowPassBackground) = 0;

    /// Pictures with a canvas that render() may be ahead of complete(). 0: their canvases are filled when it returns.
    virtual std::size_t picturesInFlight() const { return 0; }
    /// Waits until the canvas of the oldest picture that is not complete is filled. Returns what render() did not know
    /// of it: counts and times.
    virtual DrawnPicture complete() { return {}; }

    /// environmentFromWorld: see passes::LightPass. watch: of an OpenGL device it is asked when all is handed over
    /// only.
    virtual DrawnPicture render(PlateInput plate, const shared::FrameConstants& constants,
                                const particles::CellList& cells, const glm::mat3& environmentFromWorld,
                                const Watch& watch) = 0;
};

/// device "auto": a GPU if there is one, else the processor. "cpu": the processor. "gpu" and numbers: that device, by
/// OpenGL; so do all where there is a shader folder. Throws Error(Graphics) where OpenGL is needed and is not there.
std::unique_ptr<PictureRenderer> makePictureRenderer(const PictureSetup& setup);

}  // namespace virga::shot
