// Pictures of every format: what nothing changes comes back, bit for bit or as the codes that it was; what is drawn is
// the same in all of them.
#include <cmath>
#include <ostream>
#include <random>

#include "Caller.h"

namespace virga::test {
namespace {

struct Format {
    const char* name;
    virga_layout layout;
    virga_samples samples;
    int bits;
    bool hasAlphaPlane;
    const char* colorspace;
};

/// CTest's names have it.
void PrintTo(const Format& format, std::ostream* out) { *out << format.name; }

constexpr Format formats[] = {
    {"rgba8", VIRGA_RGBA, VIRGA_UINT8, 0, false, "sRGB"},
    {"rgb8", VIRGA_RGB, VIRGA_UINT8, 0, false, "sRGB"},
    {"bgra8", VIRGA_BGRA, VIRGA_UINT8, 0, false, "sRGB"},
    {"grey8", VIRGA_GREY, VIRGA_UINT8, 0, false, "sRGB"},
    {"rgba16", VIRGA_RGBA, VIRGA_UINT16, 0, false, "sRGB"},
    {"rgb10", VIRGA_RGB, VIRGA_UINT16, 10, false, "sRGB"},
    {"rgba12log", VIRGA_RGBA, VIRGA_UINT16, 12, false, "ARRI LogC4"},
    {"rgbaHalf", VIRGA_RGBA, VIRGA_HALF, 0, false, nullptr},
    {"rgbHalf", VIRGA_RGB, VIRGA_HALF, 0, false, nullptr},
    {"rgbaFloat", VIRGA_RGBA, VIRGA_FLOAT, 0, false, nullptr},
    {"greyFloat", VIRGA_GREY, VIRGA_FLOAT, 0, false, nullptr},
    {"planesFloat", VIRGA_RGBA_PLANES, VIRGA_FLOAT, 0, true, nullptr},
    {"planes8opaque", VIRGA_RGBA_PLANES, VIRGA_UINT8, 0, false, "sRGB"},
    {"yuv420p", VIRGA_YUV420, VIRGA_UINT8, 0, false, "sRGB"},
    {"yuv422p10", VIRGA_YUV422, VIRGA_UINT16, 10, false, "sRGB"},
    {"yuv444p12", VIRGA_YUV444, VIRGA_UINT16, 12, false, "Rec.2020"},
    {"yuva444p16", VIRGA_YUV444, VIRGA_UINT16, 0, true, "sRGB"},
};

class Formats : public testing::TestWithParam<Format> {
protected:
    static constexpr int width = 37, height = 29;  // odd: chroma that pixels share ends in half a block

    std::unique_ptr<Frame> newFrame() const
    {
        const Format& f = GetParam();
        auto frame = std::make_unique<Frame>(width, height, f.layout, f.samples, f.bits, f.hasAlphaPlane);
        frame->picture.color_space = f.colorspace;
        frame->picture.is_straight = f.samples == VIRGA_UINT8 || f.samples == VIRGA_UINT16;
        return frame;
    }

    /// Any codes; alpha is never 0, under which colours are lost. Floats from 0 to 1.
    void fill(Frame& frame) const
    {
        const Format& f = GetParam();
        std::mt19937 random(7);
        const int bits = f.bits != 0 ? f.bits : f.samples == VIRGA_UINT8 ? 8 : 16;
        const unsigned top = (1u << bits) - 1;
        const bool hasAlphaInside = f.layout == VIRGA_RGBA || f.layout == VIRGA_BGRA;
        for (std::size_t k = 0; k < frame.planes().size(); ++k) {
            std::byte* at = frame.plane(int(k)).data();
            const std::size_t bytes = f.samples == VIRGA_FLOAT ? 4 : f.samples == VIRGA_UINT8 ? 1 : 2;
            for (std::size_t i = 0; i < frame.plane(int(k)).size() / bytes; ++i, at += bytes) {
                const bool isAlpha = hasAlphaInside ? i % 4 == 3 : k == 3;
                const unsigned code = isAlpha ? top - random() % 3 : random() % (top + 1);
                if (f.samples == VIRGA_UINT8) {
                    *at = std::byte(code);
                } else if (f.samples == VIRGA_UINT16) {
                    const auto word = std::uint16_t(code);
                    std::memcpy(at, &word, sizeof word);
                } else if (f.samples == VIRGA_HALF) {
                    const auto half = std::uint16_t(isAlpha ? 0x3c00 : random() % 0x3c01);
                    std::memcpy(at, &half, sizeof half);
                } else {
                    const float value = isAlpha ? 1.0f : float(random() % 1000) / 999;
                    std::memcpy(at, &value, sizeof value);
                }
            }
        }
    }
};

TEST_P(Formats, WithNothingOnEveryBitIsAsItWas)
{
    const ShotPointer shot = smallShot(width, height);
    switchOff(shot.get());
    const auto plate = newFrame(), beauty = newFrame();
    fill(*plate);
    ASSERT_EQ(render(shot.get(), 3, *plate, *beauty), VIRGA_OK) << virga_error_sentence();
    EXPECT_EQ(plate->planes(), beauty->planes());
}

// Far, faint rain behind a near plate draws nothing, but everything goes through light and back.
TEST_P(Formats, PixelsThatNobodyTouchesComeBackAsTheCodesThatTheyWere)
{
    const ShotPointer shot = smallShot(width, height);
    switchOff(shot.get());
    virga_shot_set(shot.get(), "rate", "5");
    virga_shot_set(shot.get(), "opacity", "0.000001");
    const auto plate = newFrame(), beauty = newFrame();
    fill(*plate);
    ASSERT_EQ(render(shot.get(), 3, *plate, *beauty), VIRGA_OK) << virga_error_sentence();
    int isIdentity = 1;
    ASSERT_EQ(virga_shot_is_identity(shot.get(), &isIdentity), VIRGA_OK);
    ASSERT_EQ(isIdentity, 0);
    if (GetParam().samples == VIRGA_FLOAT || GetParam().samples == VIRGA_HALF) {
        for (std::size_t k = 0; k < plate->planes().size(); ++k) EXPECT_EQ(plate->plane(int(k)), beauty->plane(int(k)));
    } else {
        EXPECT_EQ(plate->planes(), beauty->planes());
    }
}

// Strides of either sign and gaps between rows and pixels say where pixels lie, not what they are.
TEST_P(Formats, StridesChangeNoPixel)
{
    const Format& f = GetParam();
    const ShotPointer shot = smallShot(width, height);
    const auto plate = newFrame(), beauty = newFrame(), turned = newFrame(), result = newFrame();
    fill(*plate);
    ASSERT_EQ(render(shot.get(), 3, *plate, *beauty), VIRGA_OK) << virga_error_sentence();
    EXPECT_NE(plate->planes(), beauty->planes());
    // Bottom row first.
    const auto turn = [&](Frame& from, Frame& to) {
        for (std::size_t k = 0; k < from.planes().size(); ++k) {
            const bool isShared = f.layout == VIRGA_YUV420 && (k == 1 || k == 2);
            const std::size_t rows = isShared ? (height + 1) / 2 : height, bytes = from.plane(int(k)).size() / rows;
            for (std::size_t y = 0; y < rows; ++y)
                std::memcpy(&to.plane(int(k))[(rows - 1 - y) * bytes], &from.plane(int(k))[y * bytes], bytes);
            to.picture.planes[k] = &to.plane(int(k))[(rows - 1) * bytes];
            to.picture.row_stride[k] = -std::ptrdiff_t(bytes);
        }
    };
    turn(*plate, *turned);
    turn(*plate, *result);
    ASSERT_EQ(render(shot.get(), 3, *turned, *result), VIRGA_OK) << virga_error_sentence();
    turn(*beauty, *turned);
    EXPECT_EQ(turned->planes(), result->planes());
}

INSTANTIATE_TEST_SUITE_P(Every, Formats, testing::ValuesIn(formats),
                         [](const auto& info) { return std::string(info.param.name); });

/// Linear floats over a plate are the truth; the plate in another format, and the result in it, are it within its
/// steps.
TEST(FormatsTogether, DrawTheSamePicture)
{
    constexpr int width = 64, height = 48;
    const ShotPointer shot = smallShot(width, height);
    Frame plate(width, height), truth(width, height), half(width, height, VIRGA_RGBA, VIRGA_HALF),
        planes(width, height, VIRGA_RGBA_PLANES, VIRGA_FLOAT, 0, true);
    paint(plate);
    ASSERT_EQ(render(shot.get(), 2, plate, truth), VIRGA_OK);
    ASSERT_EQ(render(shot.get(), 2, plate, planes), VIRGA_OK);
    ASSERT_EQ(render(shot.get(), 2, plate, half), VIRGA_OK);
    for (int i = 0; i < width * height; ++i)
        for (int c = 0; c < 4; ++c) {
            float value = 0;
            std::memcpy(&value, planes.plane(c).data() + std::size_t(i) * sizeof value, sizeof value);
            ASSERT_EQ(value, truth.floats()[4 * i + c]);
        }
    // Codes of sRGB, as an image's are, in RGB and in YCbCr of 10 bits.
    Frame codes(width, height, VIRGA_RGB, VIRGA_UINT16), yuv(width, height, VIRGA_YUV444, VIRGA_UINT16, 10);
    codes.picture.color_space = yuv.picture.color_space = "sRGB";
    ASSERT_EQ(render(shot.get(), 2, plate, codes), VIRGA_OK) << virga_error_sentence();
    ASSERT_EQ(render(shot.get(), 2, plate, yuv), VIRGA_OK) << virga_error_sentence();
    for (int i = 0; i < width * height; ++i) {
        std::uint16_t green = 0, luma = 0;
        std::memcpy(&green, codes.plane(0).data() + 2 * (3 * std::size_t(i) + 1), 2);
        std::memcpy(&luma, yuv.plane(0).data() + 2 * std::size_t(i), 2);
        const auto curve = [](double v) { return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055; };
        const float* p = truth.floats() + 4 * i;
        ASSERT_NEAR(green, 65535 * curve(double(p[1])), 1);
        const double y = 0.2126 * curve(double(p[0])) + 0.7152 * curve(double(p[1])) + 0.0722 * curve(double(p[2]));
        ASSERT_NEAR(luma, 64 + 876 * y, 1);
    }
}

/// RGB inside RGBA: every fourth sample is left alone.
TEST(FormatsTogether, APixelStrideLeavesOutWhatLiesBetween)
{
    constexpr int width = 32, height = 24;
    const ShotPointer shot = smallShot(width, height);
    Frame plate(width, height), beauty(width, height), inside(width, height);
    paint(plate);
    ASSERT_EQ(render(shot.get(), 2, plate, beauty), VIRGA_OK);
    std::fill_n(inside.floats(), inside.size(), 7.0f);
    inside.picture.layout = VIRGA_RGB;
    inside.picture.pixel_stride = 4 * sizeof(float);
    ASSERT_EQ(render(shot.get(), 2, plate, inside), VIRGA_OK) << virga_error_sentence();
    for (int i = 0; i < width * height; ++i) {
        for (int c = 0; c < 3; ++c) ASSERT_EQ(inside.floats()[4 * i + c], beauty.floats()[4 * i + c]);
        ASSERT_EQ(inside.floats()[4 * i + 3], 7.0f);
    }
}

/// 4:2:0 that becomes RGB has its chroma interpolated; a region of it is the crop of the whole.
TEST(FormatsTogether, ChromaBesideARegionCounts)
{
    constexpr int width = 64, height = 48;
    const ShotPointer shot = smallShot(width, height);
    switchOff(shot.get());
    virga_shot_set(shot.get(), "darken", "0.5");
    Frame plate(width, height, VIRGA_YUV420, VIRGA_UINT8), whole(width, height), part(20, 11);
    plate.picture.color_space = "sRGB";
    std::mt19937 random(3);
    for (int k = 0; k < 3; ++k)
        for (std::byte& code : plate.plane(k)) code = std::byte(60 + random() % 100);
    ASSERT_EQ(render(shot.get(), 0, plate, whole), VIRGA_OK) << virga_error_sentence();
    virga_request request = virga_request_default();
    request.plate = &plate.picture;
    request.beauty = &part.picture;
    request.region = part.picture.window = {17, 13, 20, 11};
    ASSERT_EQ(virga_shot_render(shot.get(), &request), VIRGA_OK) << virga_error_sentence();
    for (int y = 0; y < 11; ++y)
        for (int x = 0; x < 20; ++x)
            for (int c = 0; c < 4; ++c) ASSERT_NEAR(part.pixel(x, y)[c], whole.pixel(x + 17, y + 13)[c], 1e-6f);
}

}  // namespace
}  // namespace virga::test
