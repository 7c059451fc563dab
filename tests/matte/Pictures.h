// Pictures turned, scaled and compared, for laws of the kind "the same, but mirrored".
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/Image.h"

namespace virga::test {

inline ImageF mirrored(const ImageF& image)
{
    ImageF result(image.width(), image.height(), image.channels());
    for (int y = 0; y < image.height(); ++y)
        for (int x = 0; x < image.width(); ++x)
            for (int j = 0; j < image.channels(); ++j) result.at(image.width() - 1 - x, y, j) = image.at(x, y, j);
    return result;
}

inline ImageF transposed(const ImageF& image)
{
    ImageF result(image.height(), image.width(), image.channels());
    for (int y = 0; y < image.height(); ++y)
        for (int x = 0; x < image.width(); ++x)
            for (int j = 0; j < image.channels(); ++j) result.at(y, x, j) = image.at(x, y, j);
    return result;
}

inline ImageF scaled(const ImageF& image, float factor)
{
    ImageF result = image;
    for (float& value : result.values()) value *= factor;
    return result;
}

/// `change` of each.
template <class Change>
std::vector<ImageF> changed(const std::vector<ImageF>& images, const Change& change)
{
    std::vector<ImageF> result;
    for (const ImageF& image : images) result.push_back(change(image));
    return result;
}

inline double largestDifference(const ImageF& a, const ImageF& b)
{
    double largest = 0;
    for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(double(a.data()[i]) - b.data()[i]));
    return largest;
}

inline double largestDifference(const std::vector<ImageF>& a, const std::vector<ImageF>& b)
{
    double largest = 0;
    for (std::size_t k = 0; k < a.size(); ++k) largest = std::max(largest, largestDifference(a[k], b[k]));
    return largest;
}

inline double sumOf(const std::vector<ImageF>& images)
{
    double sum = 0;
    for (const ImageF& image : images)
        for (const float value : image.values()) sum += value;
    return sum;
}

/// Each frame keeps blocks of 16 x 16 of the one before it, as codecs do, with this probability.
template <class Uniform>
void repeatBlocks(std::vector<ImageF>& frames, double probability, Uniform&& uniform)
{
    for (std::size_t k = 1; k < frames.size(); ++k)
        for (int top = 0; top < frames[k].height(); top += 16)
            for (int left = 0; left < frames[k].width(); left += 16) {
                if (uniform() >= probability) continue;
                for (int y = top; y < std::min(top + 16, frames[k].height()); ++y)
                    for (int x = left; x < std::min(left + 16, frames[k].width()); ++x)
                        std::copy_n(frames[k - 1].pixel(x, y), frames[k].channels(), frames[k].pixel(x, y));
            }
}

}  // namespace virga::test
