// Pixels of the caller's pictures into scene-linear premultiplied RGBA, and back. Pixels that nobody changed come back
// as the codes that they were (io/Plate.h says the same of files).
#pragma once

#include "Picture.h"
#include "core/Image.h"
#include "core/Window.h"
#include "io/ColorTransform.h"

namespace virga::lib {

/// `part` grown so that it begins and ends with whole chroma samples of `picture`, or at its edge.
Window wholeChroma(const Picture& picture, const Window& part);

/// Whether pixels depend on chroma beside them.
bool interpolatesChroma(const Picture& picture, const Picture* becomes);

/// The part of the picture's window, which contains it; of YUV with whole chroma. becomes: what will be made of it, or
/// null. Chroma that both share is repeated, so that it comes back as it was; else it is interpolated.
ImageF readPixels(const Picture& picture, const Window& part, const io::ColorTransform& toLinear,
                  const Picture* becomes);

/// The first channel as it is stored, integers not scaled.
ImageF readStored(const Picture& picture);

/// rgba: of `part`, which the picture's window contains; of YUV with whole chroma. Integers are rounded to nearest and
/// clipped, NaN is 0; halves are held at 65504. Without alpha colours stay as they are under theirs.
void writePixels(ConstImageViewF rgba, const Window& part, const Picture& picture, const io::ColorTransform& toCodes);

/// Bytes, of pictures that are alike (Picture::isLike); they may be the same.
void copyPixels(const Picture& from, const Picture& to, const Window& part);

}  // namespace virga::lib
