// What turns plate frames into finished ones: the compositor, or the reference that it is measured against.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>

#include "depth/DepthImage.h"
#include "io/Plate.h"
#include "shot/FramePlan.h"

namespace virga::shot {

/// What happened, for the report.
struct CompositorStatistics {
    std::string device;                    ///< see PictureRenderer; empty if nothing is drawn
    std::map<std::string, double> passMs;  ///< summed over the frames
    double renderSeconds = 0;              ///< render() without waiting for the plate
    std::size_t frames = 0, strokes = 0, splashes = 0;
    std::map<std::string, std::size_t> made;  ///< how often each part of the shot was made: "light", "rain", "renderer"
    std::size_t rendererBytes = 0;            ///< buffers, lists and depth of the renderer, the most that they came to
    std::size_t hiddenCells = 0;     ///< of drops behind the scene's depth, not looked into; summed over the frames
    std::size_t samePlates = 0;      ///< frames with the pixels of the one before
    std::size_t lampsLeftOut = 0;    ///< as their light does not arrive; summed over the frames
    std::size_t repairedPixels = 0;  ///< NaN and Inf in plate pixels, which effects would have spread
    depth::DepthCounts depthCounts;  ///< of the last depth image read
    bool depthResampled = false;
    int lightOrder = 0;
    double lightRemainder = 0;   ///< what the order leaves out: rms over the mean radiance
    std::size_t lightCount = 0;  ///< lights of the environment that are shaded one by one
    std::string lightSource;     ///< "frames 0,24,48,72,95 of the plate", "each plate frame: the picture moves", a file
    double fogExtinction_1_m = 0;  ///< mean over the first 100 m
};

/// Belongs to the thread that made it. A frame depends on (settings, samples, frame number, plate frame) alone.
class FrameRenderer {
public:
    virtual ~FrameRenderer() = default;

    virtual const FramePlan& plan() const = 0;
    /// Renders over the plate's pixels or rows, which are of the shot's size. canvas: of PlateWriter::canvas, or null,
    /// as it must be without takesRows().
    virtual io::RenderedFrame render(io::PlateFrame plate, std::shared_ptr<RowSink> canvas) = 0;
    io::RenderedFrame render(io::PlateFrame plate) { return render(std::move(plate), nullptr); }
    /// Frames on canvases that render() may be ahead of complete(). 0: canvases are filled when it returns.
    virtual std::size_t framesInFlight() const { return 0; }
    /// Waits until the canvas of the oldest frame that is not complete is filled.
    virtual void complete() {}
    /// Whether it takes plates as Pixels::Rows, and canvases.
    virtual bool takesRows() const { return false; }
    virtual const CompositorStatistics& statistics() const = 0;
    /// Strokes that a frame will have, about; for planMemory.
    virtual double expectedStrokes() const { return 0; }
    /// Whether its buffers are OpenGL's.
    virtual bool drawsByShaders() const { return false; }
};

}  // namespace virga::shot
