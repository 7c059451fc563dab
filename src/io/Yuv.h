// Planar video pictures <-> scene-linear RGBA, in one pass over the rows.
//
// Laws (tests/io/yuv_test.cpp): codes -> RGBA -> codes gives the same codes for every format, 8 to 16 bit, also for
// YCbCr outside the RGB cube. For that, chroma is repeated on the way in and averaged over the samples that share it on
// the way out, both of the codes (not of light), and nothing is clipped until a code is stored. Where the result does
// not share chroma as the picture does, repeating would leave blocks, shifted by up to half of one: then chroma is
// interpolated between the places where it was taken (ChromaFilter), linearly and in the codes, as zimg's "bilinear".
#pragma once

#include "core/Image.h"
#include "core/PlanarPicture.h"
#include "io/ColorTransform.h"

namespace virga::io {

using virga::ChromaAxis;
using virga::ChromaFilter;
using virga::ConstPlanarPicture;
using virga::PlanarFormat;
using virga::PlanarPicture;
using virga::YuvCoding;

/// R'G'B' codes scaled to 0..1 go through `toLinear`, then are multiplied by alpha (1 where there is none).
/// rgba  picture.width x picture.height x 4
void planarToLinear(const PlanarFormat& format, const YuvCoding& coding, const ConstPlanarPicture& picture,
                    const ColorTransform& toLinear, ImageView<float> rgba, const ChromaFilter& chroma = {});

/// The rows from `firstRow` on alone, on this thread; rgba has the picture's width.
void planarRowsToLinear(const PlanarFormat& format, const YuvCoding& coding, const ConstPlanarPicture& picture,
                        const ColorTransform& toLinear, int firstRow, ImageView<float> rgba,
                        const ChromaFilter& chroma = {});

/// The other way: divided by alpha if the format has one (alpha 0 gives black), through `toCode`, rounded to nearest
/// and held to what a sample can hold; NaN gives 0. Luma and chroma may pass 235 and 16: footage does.
void linearToPlanar(const PlanarFormat& format, const YuvCoding& coding, ConstImageViewF rgba,
                    const ColorTransform& toCode, const PlanarPicture& picture);

/// The rows from `firstRow` on alone, on this thread: whole blocks of rows that share their chroma, or to the picture's
/// end.
void linearRowsToPlanar(const PlanarFormat& format, const YuvCoding& coding, ConstImageViewF rgba,
                        const ColorTransform& toCode, int firstRow, const PlanarPicture& picture);

}  // namespace virga::io
