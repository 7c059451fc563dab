#include <gtest/gtest.h>

#include <algorithm>

#include "core/PictureRows.h"

namespace virga {
namespace {

ImageF numbered(int width, int height)
{
    ImageF image(width, height, 4);
    for (std::size_t i = 0; i < image.size(); ++i) image.data()[i] = float(i);
    return image;
}

/// Where the rows went, and whether each came once and with its neighbours.
struct Canvas final : RowSink {
    Canvas(int width, int height) : picture(width, height, 4), times(std::size_t(height)) {}
    void write(int firstRow, ConstImageViewF rgba) override
    {
        EXPECT_EQ(firstRow % rowsPerChroma, 0);
        EXPECT_TRUE(rgba.height() % rowsPerChroma == 0 || firstRow + rgba.height() == picture.height());
        for (int y = 0; y < rgba.height(); ++y) {
            std::copy_n(rgba.row(y), 4 * picture.width(), picture.row(firstRow + y));
            ++times[std::size_t(firstRow + y)];
        }
    }
    ImageF picture;
    std::vector<int> times;
};

TEST(PictureRows, WholePicturesGoThroughRowsUnchanged)
{
    for (const int height : {1, 3, 4, 5, 16, 17, 32, 71}) {
        const ImageF image = numbered(7, height);
        const ImageF read = wholePicture(ImageRows(image));
        EXPECT_TRUE(std::equal(image.values().begin(), image.values().end(), read.values().begin())) << height;
        Canvas canvas(7, height);
        writePicture(image, canvas);
        EXPECT_TRUE(std::equal(image.values().begin(), image.values().end(), canvas.picture.values().begin()));
        EXPECT_EQ(canvas.times, std::vector<int>(std::size_t(height), 1));
    }
}

TEST(PictureRows, RowsOfAViewKeepItsStride)
{
    const ImageF image = numbered(9, 12);
    const ConstImageViewF inner(image.pixel(2, 1), 5, 10, 4, 9 * 4);
    const ConstImageViewF rows = rowsOf(inner, 3, 7);
    EXPECT_EQ(rows.width(), 5);
    EXPECT_EQ(rows.height(), 4);
    EXPECT_EQ(rows.at(4, 3, 2), image.at(6, 7, 2));
    ImageF read(5, 2, 4);
    ImageRows(inner).read(8, read);
    EXPECT_EQ(read.at(0, 1, 0), image.at(2, 10, 0));
}

}  // namespace
}  // namespace virga
