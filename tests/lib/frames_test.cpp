// Frames: order, layers, regions, scales, progress, what is asked of the plate.
#include <algorithm>
#include <cmath>

#include "FrameTest.h"

namespace virga::test {
namespace {

class Frames : public FrameTest {};

TEST_F(Frames, AreTheSameInAnyOrder)
{
    set("wind", "3,1");
    ASSERT_EQ(render(shot.get(), 5, plate, beauty), VIRGA_OK);
    for (const std::int64_t number : {7, -3, 5, 1000000, 5}) {
        ASSERT_EQ(render(shot.get(), number, plate, again), VIRGA_OK) << virga_error_sentence();
        if (number == 5)
            EXPECT_EQ(again.planes(), beauty.planes());
        else
            EXPECT_NE(again.planes(), beauty.planes());
    }
}

// Half-way between two frames at 24 a second is a frame at 48.
TEST_F(Frames, MayLieBetweenWholeNumbers)
{
    for (const double number : {10.5, -3.25, 0.0}) {
        set("fps", "auto");
        request.frame = number;
        request.beauty = &beauty.picture;
        ASSERT_EQ(go(), VIRGA_OK) << virga_error_sentence();
        set("fps", "96");
        request.frame = 4 * number;
        request.beauty = &again.picture;
        ASSERT_EQ(go(), VIRGA_OK);
        EXPECT_EQ(again.planes(), beauty.planes()) << number;
    }
    set("fps", "auto");
    request.frame = 10;
    ASSERT_EQ(go(), VIRGA_OK);
    request.frame = 10.5;
    request.beauty = &beauty.picture;
    ASSERT_EQ(go(), VIRGA_OK);
    EXPECT_NE(again.planes(), beauty.planes());
}

// Beyond the frame there is rain where there is a plate: what the region needs must be given.
TEST_F(Frames, RegionsMayReachBeyondTheFrame)
{
    ASSERT_EQ(virga_shot_add_plate_sample(shot.get(), 0, &plate.picture), VIRGA_OK);
    ASSERT_EQ(go(), VIRGA_OK);
    request.region = {-8, -4, 40, 30};
    request.beauty = &again.picture;
    again.picture.window = {-8, -4, width, height};
    EXPECT_EQ(go(), VIRGA_ERROR_INVALID_ARGUMENT);
    EXPECT_NE(std::string(virga_error_sentence()).find("40 x 30 at (-8, -4) (virga_shot_plate_needed)"),
              std::string::npos);
    Frame wide(40, 30);
    paint(wide);
    for (int y = 0; y < 26; ++y) std::copy_n(plate.pixel(0, y), 4 * 32, wide.floats() + 4 * ((y + 4) * 40 + 8));
    wide.picture.window = request.region;
    request.plate = &wide.picture;
    ASSERT_EQ(go(), VIRGA_OK) << virga_error_sentence();
    for (int y = 0; y < 26; ++y)
        for (int x = 0; x < 32; ++x)
            for (int c = 0; c < 4; ++c)
                ASSERT_NEAR(again.pixel(x + 8, y + 4)[c], beauty.pixel(x, y)[c], 2e-4f) << x << ", " << y;
}

// What was set and set back leaves no trace, whatever was made anew in between.
TEST_F(Frames, AreThoseOfTheSettingsAsTheyAre)
{
    ASSERT_EQ(render(shot.get(), 5, plate, beauty), VIRGA_OK);
    for (const auto& [name, text] : {std::pair{"wind", "8,0"},
                                     {"darken", "0.6"},
                                     {"ground", "1.6,4"},
                                     {"env-order", "4"},
                                     {"fps", "50"},
                                     {"seed", "9"}}) {
        const char* before = nullptr;
        ASSERT_EQ(virga_shot_get(shot.get(), name, &before), VIRGA_OK);
        const std::string kept = before;
        set(name, text);
        ASSERT_EQ(render(shot.get(), 5, plate, again), VIRGA_OK) << name << ": " << virga_error_sentence();
        EXPECT_NE(again.planes(), beauty.planes()) << name;
        set(name, kept.c_str());
        ASSERT_EQ(render(shot.get(), 5, plate, again), VIRGA_OK);
        EXPECT_EQ(again.planes(), beauty.planes()) << name;
    }
}

TEST_F(Frames, MayBeDrawnOverTheirOwnPlate)
{
    ASSERT_EQ(go(), VIRGA_OK);
    request.beauty = &plate.picture;
    ASSERT_EQ(go(), VIRGA_OK);
    EXPECT_EQ(plate.planes(), beauty.planes());
}

TEST_F(Frames, AreTheirLayersOverEachOther)
{
    set("ground", "1.6,4");
    Frame rain(width, height), splash(width, height), fog(width, height), graded(width, height);
    request.rain = &rain.picture, request.splash = &splash.picture, request.fog = &fog.picture;
    request.graded_plate = &graded.picture;
    ASSERT_EQ(go(), VIRGA_OK) << virga_error_sentence();
    float most = 0, wet = 0, foggy = 0;
    for (std::size_t i = 0; i < beauty.size(); i += 4) {
        const auto over = [&](const Frame& a, const float* b, float* out) {
            for (int c = 0; c < 4; ++c) out[c] = a.floats()[i + std::size_t(c)] + (1 - a.floats()[i + 3]) * b[c];
        };
        float mixed[4];
        over(fog, graded.floats() + i, mixed);
        over(splash, mixed, mixed);
        over(rain, mixed, mixed);
        for (int c = 0; c < 4; ++c) most = std::max(most, std::abs(mixed[c] - beauty.floats()[i + std::size_t(c)]));
        wet = std::max(wet, rain.floats()[i + 3]);
        foggy = std::max(foggy, fog.floats()[i + 3]);
    }
    EXPECT_LT(most, 1e-5f);
    EXPECT_GT(wet, 0.05f);
    EXPECT_GT(foggy, 0.0f);
    // One alone is the same, and nobody need want the beauty.
    request.beauty = request.splash = request.fog = request.graded_plate = nullptr;
    request.rain = &again.picture;
    ASSERT_EQ(go(), VIRGA_OK);
    EXPECT_EQ(again.planes(), rain.planes());
}

TEST_F(Frames, WithNothingOnHaveEmptyLayersAndOpenNoDevice)
{
    switchOff(shot.get());
    ASSERT_EQ(virga_shot_set_device(shot.get(), "gpu"), VIRGA_OK);
    const std::uint64_t contexts = count("contexts"), frames = count("frames");
    Frame rain(width, height), graded(width, height);
    std::fill_n(rain.floats(), rain.size(), 1.0f);
    request.rain = &rain.picture, request.graded_plate = &graded.picture;
    plate.floats()[10] = std::nanf("5");
    ASSERT_EQ(go(), VIRGA_OK);
    EXPECT_EQ(beauty.planes(), plate.planes());
    EXPECT_EQ(graded.planes(), plate.planes());
    EXPECT_TRUE(std::all_of(rain.floats(), rain.floats() + rain.size(), [](float v) { return v == 0; }));
    EXPECT_EQ(count("contexts"), contexts);
    EXPECT_EQ(count("frames"), frames);
    const char* device = nullptr;
    ASSERT_EQ(virga_shot_device(shot.get(), &device), VIRGA_OK);
    EXPECT_STREQ(device, "");
}

// src/shot/View.h: a region is the crop of the whole, to 2e-4.
TEST_F(Frames, RegionsAreCropsOfTheWhole)
{
    set("blur", "1.5");
    ASSERT_EQ(go(), VIRGA_OK);
    for (const virga_window region : {virga_window{0, 0, 20, 10}, {33, 17, 40, 30}, {width - 9, height - 7, 9, 7}}) {
        Frame part(region.width, region.height);
        part.picture.window = region;
        request.beauty = &part.picture;
        request.region = region;
        ASSERT_EQ(go(), VIRGA_OK) << virga_error_sentence();
        for (int y = 0; y < region.height; ++y)
            for (int x = 0; x < region.width; ++x)
                for (int c = 0; c < 4; ++c)
                    ASSERT_NEAR(part.pixel(x, y)[c], beauty.pixel(region.x + x, region.y + y)[c], 2e-4f)
                        << x << ", " << y << " of " << region.x;
    }
}

// A picture that is larger than the region is written inside it alone.
TEST_F(Frames, NothingIsWrittenBesideTheRegion)
{
    std::fill_n(beauty.floats(), beauty.size(), -1.0f);
    request.region = {10, 20, 30, 25};
    ASSERT_EQ(go(), VIRGA_OK) << virga_error_sentence();
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const bool isInside = x >= 10 && x < 40 && y >= 20 && y < 45;
            ASSERT_EQ(beauty.pixel(x, y)[3] == -1.0f, !isInside) << x << ", " << y;
        }
}

// With light that does not come from the frame, a region needs no more of the plate than what blur spreads into it.
TEST_F(Frames, SayWhatTheyNeedOfThePlate)
{
    request.region = {30, 20, 10, 10};
    virga_window needed{};
    ASSERT_EQ(virga_shot_plate_needed(shot.get(), &request, &needed), VIRGA_OK) << virga_error_sentence();
    EXPECT_EQ(needed.width, width);  // it lights the rain
    EXPECT_EQ(needed.height, height);

    ASSERT_EQ(virga_shot_add_plate_sample(shot.get(), 0, &plate.picture), VIRGA_OK);
    ASSERT_EQ(virga_shot_plate_needed(shot.get(), &request, &needed), VIRGA_OK);
    EXPECT_EQ(needed.x, 30);
    EXPECT_EQ(needed.width, 10);
    set("blur", "2");
    ASSERT_EQ(virga_shot_plate_needed(shot.get(), &request, &needed), VIRGA_OK);
    EXPECT_LT(needed.x, 30 - 5);
    EXPECT_GT(needed.x + needed.width, 40 + 5);

    // Given that much and no more, it is the frame's.
    Frame whole(width, height), part(needed.width, needed.height), result(10, 10);
    virga_request all = request;
    all.region = {};
    all.beauty = &whole.picture;
    ASSERT_EQ(virga_shot_render(shot.get(), &all), VIRGA_OK);
    for (int y = 0; y < needed.height; ++y)
        std::copy_n(plate.pixel(needed.x, needed.y + y), 4 * needed.width, part.floats() + 4 * y * needed.width);
    part.picture.window = needed;
    result.picture.window = request.region;
    request.plate = &part.picture;
    request.beauty = &result.picture;
    ASSERT_EQ(go(), VIRGA_OK) << virga_error_sentence();
    for (int y = 0; y < 10; ++y)
        for (int x = 0; x < 10; ++x)
            for (int c = 0; c < 4; ++c) ASSERT_NEAR(result.pixel(x, y)[c], whole.pixel(30 + x, 20 + y)[c], 2e-4f);

    part.picture.window.x += 1;
    EXPECT_EQ(go(), VIRGA_ERROR_INVALID_ARGUMENT);
    EXPECT_NE(std::string(virga_error_sentence()).find("virga_shot_plate_needed"), std::string::npos);
}

// A proxy shows the same rain: means over blocks are those of the whole.
TEST_F(Frames, HalfScaleIsTheWholeReduced)
{
    ASSERT_EQ(virga_shot_add_plate_sample(shot.get(), 0, &plate.picture), VIRGA_OK);
    ASSERT_EQ(go(), VIRGA_OK);
    int w = 0, h = 0;
    ASSERT_EQ(virga_shot_frame_size(shot.get(), 0.5, &w, &h), VIRGA_OK);
    ASSERT_EQ(w, width / 2);
    ASSERT_EQ(h, height / 2);
    Frame small(w, h), result(w, h);
    const auto reduced = [&](const Frame& from, int x, int y, int c) {
        return (from.pixel(2 * x, 2 * y)[c] + from.pixel(2 * x + 1, 2 * y)[c] + from.pixel(2 * x, 2 * y + 1)[c] +
                from.pixel(2 * x + 1, 2 * y + 1)[c]) /
               4;
    };
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x)
            for (int c = 0; c < 4; ++c) small.floats()[4 * (y * w + x) + c] = reduced(plate, x, y, c);
    request.plate = &small.picture;
    request.beauty = &result.picture;
    request.scale = 0.5;
    ASSERT_EQ(go(), VIRGA_OK) << virga_error_sentence();
    double error = 0, effect = 0;
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x)
            for (int c = 0; c < 3; ++c) {
                const double whole = double(reduced(beauty, x, y, c));
                error += std::pow(double(result.pixel(x, y)[c]) - whole, 2);
                effect += std::pow(whole - double(small.pixel(x, y)[c]), 2);
            }
    EXPECT_GT(effect, 0.0);
    EXPECT_LT(std::sqrt(error / effect), 0.3);
}

TEST_F(Frames, TellHowFarTheyAreAndStop)
{
    struct Told {
        std::vector<double> shares;
        double stopAt = 2;
    } told;
    request.user = &told;
    request.progress = [](void* user, double done) -> int {
        auto& t = *static_cast<Told*>(user);
        t.shares.push_back(done);
        return done >= t.stopAt ? VIRGA_STOP : VIRGA_CONTINUE;
    };
    ASSERT_EQ(go(), VIRGA_OK);
    ASSERT_GE(told.shares.size(), 2u);
    EXPECT_EQ(told.shares.front(), 0);
    EXPECT_EQ(told.shares.back(), 1);
    EXPECT_TRUE(std::is_sorted(told.shares.begin(), told.shares.end()));
    const auto before = beauty.planes();
    for (const double stop : {0.0, 0.05, 0.5, 1.0}) {
        told.stopAt = stop;
        request.frame = 77;
        EXPECT_EQ(go(), VIRGA_ERROR_CANCELLED);
        EXPECT_EQ(beauty.planes(), before) << "written at " << stop;
    }
    // The next is as ever.
    told.stopAt = 2;
    request.frame = 0;
    ASSERT_EQ(go(), VIRGA_OK);
    EXPECT_EQ(beauty.planes(), before);
}

TEST_F(Frames, WithTheSameContentAreTheSame)
{
    ASSERT_EQ(go(), VIRGA_OK);
    request.beauty = &again.picture;
    request.plate_content = 12;
    for (int i = 0; i < 3; ++i) {
        ASSERT_EQ(go(), VIRGA_OK);
        EXPECT_EQ(again.planes(), beauty.planes());
    }
}

}  // namespace
}  // namespace virga::test
