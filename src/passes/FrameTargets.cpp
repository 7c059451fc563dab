#include "passes/FrameTargets.h"

#include <cassert>
#include <glm/packing.hpp>
#include <limits>

#include "passes/LightGrid.h"

namespace virga::passes {
namespace {

/// A texture of the picture's own size: fetched, never filtered.
gl::Texture pictureTexture(GLenum format, int width, int height)
{
    gl::Texture texture = gl::Texture::make2D(format, width, height);
    texture.setFilter(GL_NEAREST);
    return texture;
}

gl::Texture equirectangularTexture(ConstImageViewF map)
{
    assert(map.channels() == 3);
    gl::Texture texture = gl::Texture::make2D(GL_RGB32F, map.width(), map.height());
    texture.setFilter(GL_NEAREST);  // see common_environment.glsl
    texture.upload(GL_RGB, GL_FLOAT, map.data());
    return texture;
}

gl::Buffer zeroedBuffer(std::size_t bytes)
{
    gl::Buffer buffer(bytes);
    buffer.clear();
    return buffer;
}

}  // namespace

FrameTargets::FrameTargets(int width, int height, const Features& features)
    : features_(features), constants_(sizeof(shared::FrameConstants))
{
    frame_.lights.y = coarsestLightGrid;
    resize(width, height);
}

void FrameTargets::resize(int width, int height)
{
    width_ = width;
    height_ = height;
    const Features& features = features_;
    const std::size_t pixels = std::size_t(width) * std::size_t(height);
    plate = pictureTexture(GL_RGBA32F, width, height);
    beauty_ = gl::Buffer(pixels * 4 * sizeof(float), 0);
    if (features.rain) accumulators_ = zeroedBuffer(accumulatorBytes());
    if (features.splashes) splashAccumulators_ = zeroedBuffer(accumulatorBytes());
    if (features.depth) depth_ = pictureTexture(GL_R32F, width, height);
    if (features.light()) makeLightGrid(lightGridStep());
    if (features.blur) {
        blurA = pictureTexture(GL_RGBA32F, width, height);
        blurB = pictureTexture(GL_RGBA32F, width, height);
    }
    if (features.layers) layers_ = gl::Buffer(4 * pixels * 4 * sizeof(float), 0);
    if (features.nearest) {
        nearestDepth = gl::Buffer(pixels * sizeof(std::uint32_t));
        nearestMotion = gl::Buffer(pixels * sizeof(std::uint32_t));
    }
}

std::size_t FrameTargets::accumulatorBytes() const
{
    // As accumulatorsPerPixel of common_frame.glsl.
    const std::size_t sums = 1 + (features_.fog ? 1 : 0) + (features_.lights ? 3 : 0);
    return std::size_t(width_) * std::size_t(height_) * sums * sizeof(std::uint32_t);
}

void FrameTargets::setConstants(const shared::FrameConstants& constants)
{
    const std::uint32_t step = frame_.lights.y;
    frame_ = constants;
    frame_.lights.y = step;
    fitLightGrid();
    constants_.upload(&frame_, sizeof frame_);
}

void FrameTargets::fitLightGrid()
{
    if (!dropRadiance_ || !(frame_.lens.x > 0)) return;
    const int step = passes::lightGridStep(dropRadiance_.width(), frame_.lens.x);
    if (step != lightGridStep()) makeLightGrid(step);
}

void FrameTargets::makeLightGrid(int step)
{
    frame_.lights.y = std::uint32_t(step);
    const int columns = width_ / step + 2, rows = height_ / step + 2;
    lightGrid = gl::Texture::make2D(GL_RGBA32F, columns, rows);
    if (features_.lowPass()) lowPassGrid = gl::Texture::make2D(GL_RGBA32F, columns, rows);
}

void FrameTargets::uploadPlate(ConstImageViewF rgba)
{
    assert(rgba.width() == width_ && rgba.height() == height_ && rgba.channels() == 4);
    plate.upload(GL_RGBA, GL_FLOAT, rgba.data());
}

void FrameTargets::uploadDepth(ConstImageViewF depth)
{
    assert(depth.width() == width_ && depth.height() == height_ && depth.channels() == 1);
    depth_.upload(GL_RED, GL_FLOAT, depth.data());
}

void FrameTargets::uploadFogTable(const std::vector<float>& opticalDepth)
{
    fogTable_ = gl::Texture::make2D(GL_R32F, int(opticalDepth.size()), 1);
    fogTable_.upload(GL_RED, GL_FLOAT, opticalDepth.data());
}

void FrameTargets::uploadVeilTable(const std::vector<float>& sums)
{
    veilTable_ = gl::Texture::make2D(GL_RG32F, int(sums.size() / 2), 1);
    veilTable_.upload(GL_RG, GL_FLOAT, sums.data());
}

void FrameTargets::uploadDropRadiance(ConstImageViewF radiance, ConstImageViewF lowPassBackground)
{
    dropRadiance_ = equirectangularTexture(radiance);
    if (features_.lowPass()) lowPass_ = equirectangularTexture(lowPassBackground);
    setConstants(frame_);  // the grid may need another step
}

void FrameTargets::uploadRingTransfer(const std::vector<float>& ringTransfer)
{
    ringTransfer_ = gl::Texture::make2D(GL_RGB32F, int(ringTransfer.size() / 3), 1);
    ringTransfer_.upload(GL_RGB, GL_FLOAT, ringTransfer.data());
}

void FrameTargets::uploadLights(std::span<const shared::PointLight> lights)
{
    lights_.reserve(lights.size_bytes());
    lights_.upload(lights);
}

void FrameTargets::uploadLut(int size, const std::vector<float>& rgb)
{
    lut_ = gl::Texture::make3D(GL_RGB32F, size, size, size);
    lut_.upload(GL_RGB, GL_FLOAT, rgb.data());
}

void FrameTargets::bind() const
{
    const auto bindTexture = [](const gl::Texture& texture, TextureUnit unit) {
        if (texture) texture.bind(unit);
    };
    bindTexture(plate, PlateUnit);
    bindTexture(depth_, DepthUnit);
    bindTexture(fogTable_, FogTableUnit);
    bindTexture(veilTable_, VeilTableUnit);
    bindTexture(lightGrid, DropRadianceUnit);
    bindTexture(lowPassGrid, LowPassUnit);
    bindTexture(lut_, LutUnit);
    bindTexture(ringTransfer_, RingTransferUnit);

    const auto bindBuffer = [](const gl::Buffer& buffer, StorageIndex index) {
        if (buffer.name() != 0) buffer.bindStorage(index);
    };
    bindBuffer(constants_, FrameIndex);
    bindBuffer(accumulators_, AccumulatorsIndex);
    bindBuffer(beauty_, BeautyIndex);
    bindBuffer(layers_, LayersIndex);
    bindBuffer(nearestDepth, NearestDepthIndex);
    bindBuffer(nearestMotion, NearestMotionIndex);
    bindBuffer(splashAccumulators_, SplashAccumulatorsIndex);
    bindBuffer(lights_, LightsIndex);
}

void FrameTargets::bindLightMaps() const
{
    dropRadiance_.bind(DropRadianceUnit);
    if (lowPass_) lowPass_.bind(LowPassUnit);
}

std::size_t FrameTargets::bytes() const
{
    std::size_t all = 0;
    for (const gl::Buffer* buffer : {&constants_, &accumulators_, &splashAccumulators_, &beauty_, &layers_, &lights_,
                                     &nearestDepth, &nearestMotion})
        all += buffer->bytes();
    for (const gl::Texture* texture : {&plate, &blurA, &blurB, &lightGrid, &lowPassGrid, &depth_, &fogTable_,
                                       &dropRadiance_, &lowPass_, &lut_, &ringTransfer_})
        all += texture->bytes();
    return all;
}

ImageF FrameTargets::readPixels(const gl::Buffer& buffer, std::size_t firstPixel) const
{
    ImageF image(width_, height_, 4);
    buffer.download(image.data(), image.size() * sizeof(float), firstPixel * 4 * sizeof(float));
    return image;
}

ImageF FrameTargets::readBeauty() const { return readPixels(beauty_, 0); }

ImageF FrameTargets::readLayer(LayerIndex layer) const
{
    return readPixels(layers_, std::size_t(layer) * std::size_t(width_) * std::size_t(height_));
}

ImageF FrameTargets::readNearestDepth() const
{
    ImageF depth(width_, height_, 1);
    nearestDepth.download(depth.data(), depth.size() * sizeof(float));
    return depth;  // cleared to the bits of +inf
}

ImageF FrameTargets::readNearestMotion() const
{
    std::vector<std::uint32_t> packed(std::size_t(width_) * std::size_t(height_));
    nearestMotion.download(packed.data(), packed.size() * sizeof(std::uint32_t));
    ImageF motion(width_, height_, 2);
    for (std::size_t i = 0; i < packed.size(); ++i) {
        const glm::vec2 way = glm::unpackHalf2x16(packed[i]);
        motion.data()[2 * i] = way.x;
        motion.data()[2 * i + 1] = way.y;
    }
    return motion;
}

}  // namespace virga::passes
