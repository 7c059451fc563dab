#include "core/PictureRows.h"

#include <algorithm>

#include "core/Parallel.h"

namespace virga {
namespace {

/// Calls body(first row, one past the last) for pieces of a picture, on several threads.
template <class Body>
void forPieces(int height, const Body& body)
{
    constexpr int rowsPerPiece = 4 * rowsPerChroma;
    parallelFor(0, (height + rowsPerPiece - 1) / rowsPerPiece, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        body(int(first) * rowsPerPiece, std::min(int(last) * rowsPerPiece, height));
    });
}

}  // namespace

void ImageRows::read(int firstRow, ImageView<float> rgba) const
{
    const auto count = std::size_t(image_.width()) * std::size_t(image_.channels());
    for (int y = 0; y < rgba.height(); ++y) std::copy_n(image_.row(firstRow + y), count, rgba.row(y));
}

ImageF wholePicture(const RowSource& rows)
{
    ImageF result(rows.width(), rows.height(), 4);
    forPieces(rows.height(), [&](int first, int last) { rows.read(first, rowsOf(result.view(), first, last)); });
    return result;
}

void writePicture(ConstImageViewF rgba, RowSink& rows)
{
    forPieces(rgba.height(), [&](int first, int last) { rows.write(first, rowsOf(rgba, first, last)); });
}

}  // namespace virga
