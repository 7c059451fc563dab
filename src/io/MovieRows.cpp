#include "io/MovieRows.h"

extern "C" {
#include <libavutil/frame.h>
}

#include <utility>

namespace virga::io {

DecodedRows::DecodedRows(std::shared_ptr<const AVFrame> picture, const PlanesOfLight& planes)
    : picture_(std::move(picture)), planar_(libav::asConst(libav::planesOf(*picture_))), planes_(planes)
{
}

void DecodedRows::read(int firstRow, ImageView<float> rgba) const
{
    planarRowsToLinear(planes_.format, planes_.coding, planar_, *planes_.transform, firstRow, rgba, planes_.chroma);
}

std::optional<ConstCodedPlanes> DecodedRows::codes() const
{
    const std::optional<PowerCurve> curve = planes_.transform->power();
    if (!curve) return std::nullopt;
    return ConstCodedPlanes{planes_.format, planes_.coding, planes_.chroma, *curve, planar_};
}

EncoderRows::EncoderRows(libav::Frame picture, const PlanesOfLight& planes)
    : picture_(std::move(picture)), planar_(libav::planesOf(*picture_)), planes_(planes)
{
}

void EncoderRows::write(int firstRow, ConstImageViewF rgba)
{
    linearRowsToPlanar(planes_.format, planes_.coding, rgba, *planes_.transform, firstRow, planar_);
}

std::optional<CodedPlanes> EncoderRows::codes()
{
    const std::optional<PowerCurve> curve = planes_.transform->power();
    if (!curve) return std::nullopt;
    return CodedPlanes{planes_.format, planes_.coding, planes_.chroma, *curve, planar_};
}

}  // namespace virga::io
