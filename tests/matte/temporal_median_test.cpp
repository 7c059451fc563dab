#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "matte/TemporalMedian.h"

namespace virga {
namespace {

// Beside sorting, for every number of frames that the network may meet; sizes that do not fill its tiles.
TEST(TemporalMedian, IsTheMiddleOfTheSorted)
{
    std::mt19937 engine(7);
    for (int count = 1; count <= 70; ++count) {
        std::vector<ImageF> frames(std::size_t(count), ImageF(23, 3, 3));
        for (ImageF& frame : frames)
            for (float& value : frame.values()) value = float(engine() % 50) - 10.0f;  // with ties
        const ImageF median = matte::temporalMedian(frames);
        for (std::size_t i = 0; i < median.size(); ++i) {
            std::vector<float> sorted;
            for (const ImageF& frame : frames) sorted.push_back(frame.data()[i]);
            std::sort(sorted.begin(), sorted.end());
            const float expected = 0.5f * (sorted[(sorted.size() - 1) / 2] + sorted[sorted.size() / 2]);
            ASSERT_EQ(median.data()[i], expected) << count << " frames";
        }
    }
}

}  // namespace
}  // namespace virga
