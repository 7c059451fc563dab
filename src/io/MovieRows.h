// Pictures of movies between codes and light, a few rows at a time: what the decoder gave, and what the encoder takes.
#pragma once

#include <memory>

#include "core/PictureRows.h"
#include "io/Libav.h"

namespace virga::io {

/// How a movie's planes and light belong together.
struct PlanesOfLight {
    PlanarFormat format;
    YuvCoding coding;
    std::shared_ptr<const ColorTransform> transform;  ///< to linear of what is read, to code of what is written
    ChromaFilter chroma{};                            ///< of what is read
};

class DecodedRows final : public RowSource {
public:
    /// `picture`: isPlanar, in `planes.format`; not null.
    DecodedRows(std::shared_ptr<const AVFrame> picture, const PlanesOfLight& planes);

    int width() const override { return planar_.width; }
    int height() const override { return planar_.height; }
    void read(int firstRow, ImageView<float> rgba) const override;
    std::optional<ConstCodedPlanes> codes() const override;

private:
    std::shared_ptr<const AVFrame> picture_;
    ConstPlanarPicture planar_;
    PlanesOfLight planes_;
};

class EncoderRows final : public RowSink {
public:
    /// `picture`: with memory, isPlanar, in `planes.format`; not null.
    EncoderRows(libav::Frame picture, const PlanesOfLight& planes);

    void write(int firstRow, ConstImageViewF rgba) override;
    std::optional<CodedPlanes> codes() override;
    /// The picture, once all rows are written; nothing may be written after that.
    libav::Frame take() { return std::move(picture_); }

private:
    libav::Frame picture_;
    PlanarPicture planar_;
    PlanesOfLight planes_;
};

}  // namespace virga::io
