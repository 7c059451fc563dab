#include "bench/PictureError.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "bench/Flip.h"

namespace virga::bench {

double meanOf(ConstImageViewF picture)
{
    double sum = 0;
    for (int y = 0; y < picture.height(); ++y)
        for (int x = 0; x < picture.width(); ++x)
            for (int c = 0; c < 3; ++c) sum += double(picture.at(x, y, c));
    return sum / (3.0 * picture.width() * picture.height());
}

PictureError pictureError(ConstImageViewF picture, ConstImageViewF truth, double mean)
{
    assert(picture.width() == truth.width() && picture.height() == truth.height());
    PictureError error;
    for (int y = 0; y < truth.height(); ++y)
        for (int x = 0; x < truth.width(); ++x)
            for (int c = 0; c < 3; ++c) {
                const double off = double(picture.at(x, y, c)) - double(truth.at(x, y, c));
                error.rmse += off * off;
                error.most = std::max(error.most, std::abs(off) / mean);
            }
    error.rmse = std::sqrt(error.rmse / (3.0 * truth.width() * truth.height())) / mean;
    error.flip = meanFlip(picture, truth);
    return error;
}

}  // namespace virga::bench
