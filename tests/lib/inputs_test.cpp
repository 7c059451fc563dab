// What a frame is made of beside its plate: depth and a panorama from memory, samples of the plate.
#include <algorithm>
#include <cmath>

#include "FrameTest.h"

namespace virga::test {
namespace {

class Inputs : public FrameTest {};

// Depth in memory is depth in a file: what stands near hides the rain behind it.
TEST_F(Inputs, DepthFromMemory)
{
    Frame depth(width, height, VIRGA_GREY), rain(width, height), hidden(width, height),
        millimetres(width / 2, height / 2, VIRGA_GREY, VIRGA_UINT16);
    std::fill_n(depth.floats(), depth.size(), 1e10f);
    request.rain = &rain.picture;
    request.depth = &depth.picture;
    ASSERT_EQ(go(), VIRGA_OK) << virga_error_sentence();
    // The left half is a wall at 90 cm.
    for (int y = 0; y < height; ++y) std::fill_n(depth.floats() + y * width, width / 2, 0.9f);
    request.rain = &hidden.picture;
    ASSERT_EQ(go(), VIRGA_OK);
    const auto wetness = [](const Frame& f, int x0, int x1) {
        double sum = 0;
        for (int y = 0; y < height; ++y)
            for (int x = x0; x < x1; ++x) sum += double(f.pixel(x, y)[3]);
        return sum;
    };
    EXPECT_LT(wetness(hidden, 0, width / 2 - 2), 0.2 * wetness(rain, 0, width / 2 - 2));
    EXPECT_NEAR(wetness(hidden, width / 2 + 2, width), wetness(rain, width / 2 + 2, width),
                0.02 * wetness(rain, width / 2 + 2, width));
    // The same wall as 16-bit codes of half the size, in millimetres; then no depth at all.
    for (int i = 0; i < width * height / 4; ++i) {
        const std::uint16_t code = i % (width / 2) < width / 4 ? 900 : 60000;
        std::memcpy(millimetres.plane(0).data() + 2 * i, &code, 2);
    }
    set("depth-scale", "0.001");
    request.depth = &millimetres.picture;
    Frame coded(width, height);
    request.rain = &coded.picture;
    ASSERT_EQ(go(), VIRGA_OK) << virga_error_sentence();
    EXPECT_LT(wetness(coded, 0, width / 2 - 2), 0.2 * wetness(rain, 0, width / 2 - 2));
    set("depth-scale", "1");
    request.depth = nullptr;
    request.rain = &again.picture;
    ASSERT_EQ(go(), VIRGA_OK);
    EXPECT_NEAR(wetness(again, 0, width), wetness(rain, 0, width), 0.02 * wetness(rain, 0, width));
}

TEST_F(Inputs, APanoramaFromMemory)
{
    Frame sky(64, 32), rain(width, height);
    for (std::size_t i = 0; i < sky.size(); ++i) sky.floats()[i] = i % 4 == 3 ? 1.0f : i % 4 == 2 ? 4.0f : 0.5f;
    const std::uint64_t before = count("environments");
    ASSERT_EQ(virga_shot_set_environment(shot.get(), &sky.picture), VIRGA_OK) << virga_error_sentence();
    request.rain = &rain.picture;
    ASSERT_EQ(go(), VIRGA_OK) << virga_error_sentence();
    double red = 0, blue = 0;
    for (std::size_t i = 0; i < rain.size(); i += 4)
        red += double(rain.floats()[i]), blue += double(rain.floats()[i + 2]);
    EXPECT_NEAR(blue / red, 8, 0.5);
    // The same pixels once more change nothing; others do.
    ASSERT_EQ(virga_shot_set_environment(shot.get(), &sky.picture), VIRGA_OK);
    ASSERT_EQ(go(), VIRGA_OK);
    EXPECT_LE(count("environments") - before, 1u);
    for (std::size_t i = 0; i < sky.size(); ++i) sky.floats()[i] = i % 4 == 3 ? 1.0f : 2.0f;
    ASSERT_EQ(virga_shot_set_environment(shot.get(), &sky.picture), VIRGA_OK);
    ASSERT_EQ(go(), VIRGA_OK);
    red = blue = 0;
    for (std::size_t i = 0; i < rain.size(); i += 4)
        red += double(rain.floats()[i]), blue += double(rain.floats()[i + 2]);
    EXPECT_NEAR(blue / red, 1, 0.01);
    ASSERT_EQ(virga_shot_set_environment(shot.get(), nullptr), VIRGA_OK);
    ASSERT_EQ(go(), VIRGA_OK);

    Frame photo(64, 48);
    ASSERT_EQ(virga_shot_set_environment(shot.get(), &photo.picture), VIRGA_OK);  // looked at when it is needed
    EXPECT_EQ(go(), VIRGA_ERROR_INPUT);
    EXPECT_NE(std::string(virga_error_sentence()).find("the caller's panorama 64x48"), std::string::npos)
        << virga_error_sentence();
}

TEST_F(Inputs, SamplesThatAreWanted)
{
    std::int64_t frames[16];
    std::size_t count = 0;
    ASSERT_EQ(virga_shot_samples_wanted(shot.get(), 1001, 1100, frames, 16, &count), VIRGA_OK);
    EXPECT_EQ(std::vector(frames, frames + count), (std::vector<std::int64_t>{1001, 1025, 1050, 1075, 1100}));
    ASSERT_EQ(virga_shot_samples_wanted(shot.get(), 3, 3, frames, 0, &count), VIRGA_OK);
    EXPECT_EQ(count, 1u);
    set("env-frames", "0");
    ASSERT_EQ(virga_shot_samples_wanted(shot.get(), 0, 10, frames, 16, &count), VIRGA_OK);
    EXPECT_EQ(count, 0u);
    set("grade-from", "still.png");
    ASSERT_EQ(virga_shot_samples_wanted(shot.get(), 0, 10, frames, 16, &count), VIRGA_OK);
    EXPECT_EQ(std::vector(frames, frames + count), (std::vector<std::int64_t>{0, 5, 10}));
    EXPECT_EQ(virga_shot_samples_wanted(shot.get(), 4, 3, frames, 16, &count), VIRGA_ERROR_INVALID_ARGUMENT);
}

}  // namespace
}  // namespace virga::test
