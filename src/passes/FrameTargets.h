// What the passes of a frame share on the device: its constants, its inputs and what it leaves. Made once for a picture
// size and a set of features; nothing is made that no feature needs.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/Image.h"
#include "gl/Objects.h"
#include "gl/Program.h"
#include "passes/Features.h"
#include "passes/SharedFrame.h"

namespace virga::passes {

/// Bindings, as common_frame.glsl and the passes name them.
enum TextureUnit : unsigned {
    PlateUnit,
    DepthUnit,
    FogTableUnit,
    MattesUnit,
    DropRadianceUnit,
    LowPassUnit,
    LutUnit,
    RingTransferUnit,
    VeilTableUnit
};
enum StorageIndex : unsigned {
    FrameIndex,
    CellsIndex,
    ClassesIndex,
    StrokesIndex,
    AccumulatorsIndex,
    AlongPrefixIndex,
    StrokeListsIndex,
    BeautyIndex,
    LayersIndex,
    NearestDepthIndex,
    NearestMotionIndex,
    SplashAccumulatorsIndex,
    SplashesIndex,
    SplashListIndex,
    BlocksIndex,
    LightsIndex
};

class FrameTargets {
public:
    FrameTargets(int width, int height, const Features& features);
    /// Forgets plate, depth and results; tables, maps and lamps stay.
    void resize(int width, int height);

    const Features& features() const { return features_; }
    int width() const { return width_; }
    int height() const { return height_; }

    void setConstants(const shared::FrameConstants& constants);   ///< but for the light grid's step
    void uploadPlate(ConstImageViewF rgba);                       ///< width x height x 4
    void uploadDepth(ConstImageViewF depth);                      ///< width x height x 1 [m], +inf sky
    void uploadFogTable(const std::vector<float>& opticalDepth);  ///< at places 0..1, see fogTablePlace()
    void uploadVeilTable(const std::vector<float>& sums);         ///< pairs at the same places, see frame.glsl
    void uploadDropRadiance(ConstImageViewF radiance, ConstImageViewF lowPassBackground);  ///< equirectangular RGB
    /// ringTransfer: D(theta) [1/sr] RGB at equal steps of theta from 0 to pi.
    void uploadRingTransfer(const std::vector<float>& ringTransfer);
    void uploadLights(std::span<const shared::PointLight> lights);
    void uploadLut(int size, const std::vector<float>& rgb);

    /// Everything that passes read, on its unit and index. The light pass takes the maps, later ones the grids.
    void bind() const;
    void bindLightMaps() const;

    std::size_t bytes() const;  ///< of all that is made here, on the device

    ImageF readBeauty() const;
    enum class LayerIndex { Rain, Splash, Fog, Plate };
    ImageF readLayer(LayerIndex layer) const;
    ImageF readNearestDepth() const;   ///< [m]; +inf where no stroke is
    ImageF readNearestMotion() const;  ///< x, y of the stroke from shutter open to close [px]; 0 where no stroke is

    /// The texture that the composite takes for the plate: the plate, or what the blur made of it.
    gl::Texture plate, blurA, blurB;
    gl::Texture lightGrid, lowPassGrid;  ///< see pass_light.comp

    /// See LightGrid.h [px].
    int lightGridStep() const { return int(frame_.lights.y); }
    gl::Buffer nearestDepth, nearestMotion;

private:
    std::size_t accumulatorBytes() const;
    void fitLightGrid();
    void makeLightGrid(int step);
    ImageF readPixels(const gl::Buffer& buffer, std::size_t firstPixel) const;

    Features features_;
    int width_, height_;
    shared::FrameConstants frame_{};
    gl::Buffer constants_, accumulators_, splashAccumulators_, beauty_, layers_, lights_;
    gl::Texture depth_, fogTable_, veilTable_, dropRadiance_, lowPass_, lut_, ringTransfer_;
};

}  // namespace virga::passes
