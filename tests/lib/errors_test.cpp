// What goes wrong is a code and a sentence that names the thing, the value and what is allowed.
#include <climits>
#include <cmath>
#include <thread>

#include "Caller.h"

namespace virga::test {
namespace {

constexpr int width = 32, height = 24;

class Errors : public testing::Test {
protected:
    Errors() : shot(smallShot(width, height)), plate(width, height), beauty(width, height)
    {
        paint(plate);
        request.plate = &plate.picture;
        request.beauty = &beauty.picture;
        untouched = beauty.planes();
    }
    /// The last call gave `code` and a sentence with the words; what was refused is right again afterwards.
    void said(virga_error got, virga_error code, std::initializer_list<const char*> words)
    {
        EXPECT_EQ(got, code);
        const std::string sentence = virga_error_sentence();
        for (const char* word : words) EXPECT_NE(sentence.find(word), std::string::npos) << sentence << " | " << word;
        EXPECT_EQ(sentence.find('\n'), std::string::npos);
        const char* ofShot = nullptr;
        EXPECT_EQ(virga_shot_error(shot.get(), &ofShot), code);
        EXPECT_EQ(ofShot, sentence);
        EXPECT_EQ(beauty.planes(), untouched);
    }
    void refused(std::initializer_list<const char*> words)
    {
        said(virga_shot_render(shot.get(), &request), VIRGA_ERROR_INVALID_ARGUMENT, words);
    }

    ShotPointer shot;
    Frame plate, beauty;
    std::vector<std::vector<std::byte>> untouched;
    virga_request request = virga_request_default();
};

TEST_F(Errors, OfCreation)
{
    virga_shot* made = shot.get();
    for (const auto& [w, h] : {std::pair(0, 5), {5, -1}, {16385, 5}, {INT_MAX, INT_MAX}, {INT_MIN, 5}}) {
        EXPECT_EQ(virga_shot_create(w, h, 24, &made), VIRGA_ERROR_INVALID_ARGUMENT);
        EXPECT_EQ(made, nullptr);
        EXPECT_NE(std::string(virga_error_sentence()).find("1 to 16384"), std::string::npos);
    }
    for (const double fps : {0.0, -1.0, double(INFINITY), std::nan("")})
        EXPECT_EQ(virga_shot_create(5, 5, fps, &made), VIRGA_ERROR_INVALID_ARGUMENT) << fps;
    EXPECT_EQ(virga_shot_create(5, 5, 24, nullptr), VIRGA_ERROR_INVALID_ARGUMENT);
    // Without a shot it is the thread's, and asking forgets it.
    const char* sentence = nullptr;
    EXPECT_EQ(virga_shot_error(nullptr, &sentence), VIRGA_ERROR_INVALID_ARGUMENT);
    EXPECT_STREQ(sentence, "shot: must not be NULL");
    EXPECT_EQ(virga_shot_error(nullptr, nullptr), VIRGA_OK);
}

TEST_F(Errors, OfAShotAreItsFirst)
{
    const ShotPointer other = smallShot();
    virga_shot_set(shot.get(), "rate", "-1");
    virga_shot_set(shot.get(), "wind", "x");
    const char* sentence = nullptr;
    EXPECT_EQ(virga_shot_error(other.get(), &sentence), VIRGA_OK);
    EXPECT_STREQ(sentence, "");
    EXPECT_EQ(virga_shot_error(shot.get(), &sentence), VIRGA_ERROR_INVALID_ARGUMENT);
    EXPECT_NE(std::string(sentence).find("rate"), std::string::npos);
    EXPECT_EQ(virga_shot_error(shot.get(), &sentence), VIRGA_OK);
    EXPECT_STREQ(sentence, "");
    // Another thread's failures are not this thread's, but the shot's.
    virga_shot_error(nullptr, nullptr);
    std::thread([&] { virga_shot_set(shot.get(), "fps", "-3"); }).join();
    EXPECT_STREQ(virga_error_sentence(), "");
    EXPECT_EQ(virga_shot_error(shot.get(), nullptr), VIRGA_ERROR_INVALID_ARGUMENT);
}

TEST_F(Errors, OfPointersThatAreNull)
{
    EXPECT_EQ(virga_shot_set(nullptr, "rate", "1"), VIRGA_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(virga_shot_render(nullptr, &request), VIRGA_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(virga_shot_cancel(nullptr), VIRGA_ERROR_INVALID_ARGUMENT);
    virga_shot_release(nullptr);
    said(virga_shot_render(shot.get(), nullptr), VIRGA_ERROR_INVALID_ARGUMENT, {"request", "NULL"});
    said(virga_shot_set(shot.get(), nullptr, "1"), VIRGA_ERROR_INVALID_ARGUMENT, {"name"});
    said(virga_shot_set(shot.get(), "rate", nullptr), VIRGA_ERROR_INVALID_ARGUMENT, {"text"});
    said(virga_shot_get(shot.get(), "rate", nullptr), VIRGA_ERROR_INVALID_ARGUMENT, {"text"});
    said(virga_shot_set_numbers(shot.get(), "rate", nullptr, 1), VIRGA_ERROR_INVALID_ARGUMENT, {"values"});
    said(virga_shot_set_document(shot.get(), nullptr), VIRGA_ERROR_INVALID_ARGUMENT, {"text"});
    said(virga_shot_add_plate_sample(shot.get(), 0, nullptr), VIRGA_ERROR_INVALID_ARGUMENT, {"plate sample"});
    said(virga_shot_plate_needed(shot.get(), &request, nullptr), VIRGA_ERROR_INVALID_ARGUMENT, {"plate"});
    request.plate = nullptr;
    refused({"plate", "NULL"});
    request.plate = &plate.picture;
    request.beauty = nullptr;
    refused({"asks for no picture"});
    request.beauty = &beauty.picture;
    plate.picture.planes[0] = nullptr;
    refused({"plate", "NULL"});
    Frame yuv(width, height, VIRGA_YUV420, VIRGA_UINT8);
    yuv.picture.planes[2] = nullptr;
    request.plate = &yuv.picture;
    refused({"plate, plane 2", "NULL"});
}

TEST_F(Errors, OfWordsThatNobodyKnows)
{
    plate.picture.layout = virga_layout(99);
    refused({"plate", "layout is 99"});
    plate.picture.layout = VIRGA_YUV444;
    refused({"samples is 0", "YUV"});
    plate.picture.layout = VIRGA_RGBA;
    plate.picture.samples = virga_samples(-1);
    refused({"samples is -1"});
    plate.picture.samples = VIRGA_FLOAT;
    plate.picture.significant_bits = 10;
    refused({"significant_bits is 10"});
    plate.picture.samples = VIRGA_UINT16;
    plate.picture.significant_bits = 17;
    refused({"significant_bits is 17", "9 to 16"});
    plate.picture.samples = VIRGA_FLOAT;
    plate.picture.significant_bits = 0;
    plate.picture.color_space = "sRBG";
    refused({"plate", "sRBG", "sRGB"});
    plate.picture.color_space = nullptr;
    beauty.picture.color_space = "no such space";
    refused({"beauty", "no such space"});
    const char* text = nullptr;
    said(virga_shot_get_document(shot.get(), virga_document(7), &text), VIRGA_ERROR_INVALID_ARGUMENT, {"kind is 7"});
}

TEST_F(Errors, OfStructsThatAreNoVersions)
{
    plate.picture.struct_size = 0;
    refused({"plate", "struct_size is 0"});
    plate.picture.struct_size = 1u << 20;
    refused({"plate", "struct_size"});
    plate.picture.struct_size = sizeof(virga_picture);
    request.struct_size = 8;
    refused({"request", "struct_size is 8"});
}

/// An older caller's struct ends early, a newer one's has zeros at its end; fields that are set and not known are told.
TEST_F(Errors, StructsMayBeOlderAndNewer)
{
    struct {
        virga_request known = virga_request_default();
        std::uint64_t later[2] = {0, 0};
    } newer;
    newer.known = request;
    newer.known.struct_size = sizeof newer;
    EXPECT_EQ(virga_shot_render(shot.get(), &newer.known), VIRGA_OK) << virga_error_sentence();
    untouched = beauty.planes();
    newer.later[1] = 1;
    said(virga_shot_render(shot.get(), &newer.known), VIRGA_ERROR_INVALID_ARGUMENT, {"later version"});
    request.struct_size = offsetof(virga_request, priority);
    request.priority = INT_MIN;
    EXPECT_EQ(virga_shot_render(shot.get(), &request), VIRGA_OK) << virga_error_sentence();
}

TEST_F(Errors, OfSizesStridesAndWindows)
{
    plate.picture.row_stride[0] = 16;
    refused({"plate", "row_stride of 16", "512 bytes"});
    plate.picture.row_stride[0] = -511;
    refused({"row_stride of -511"});
    plate.picture.row_stride[0] = PTRDIFF_MIN;
    refused({"row_stride"});
    plate.picture.row_stride[0] = 514;
    refused({"multiples"});
    plate.picture.row_stride[0] = 0;
    plate.picture.pixel_stride = 8;
    refused({"pixel_stride is 8"});
    plate.picture.pixel_stride = -16;
    refused({"pixel_stride is -16"});
    plate.picture.pixel_stride = 0;
    plate.picture.planes[0] = reinterpret_cast<std::byte*>(plate.picture.planes[0]) + 1;
    refused({"multiples"});
    plate.picture.planes[0] = plate.plane(0).data();

    plate.picture.window = {0, 0, INT_MAX, INT_MAX};
    refused({"plate", "2147483647"});
    plate.picture.window = {0, 0, -4, 6};
    refused({"-4 x 6"});
    plate.picture.window = {INT_MIN, 0, 4, 6};
    refused({"plate", "-2147483648"});
    plate.picture.window = {1, 0, width - 1, height};
    refused({"plate", "virga_shot_plate_needed"});
    plate.picture.window = {0, 0, width, height};
    beauty.picture.window = {0, 0, width - 1, height};
    refused({"beauty", "does not hold the region", "31 x 24"});
    beauty.picture.window = {0, 0, width, height};

    for (const virga_window region : {virga_window{0, 0, -1, 5},
                                      {0, 0, 5, 0},
                                      {0, 0, 16385, 5},
                                      {INT_MAX, 0, 5, 5},
                                      {0, INT_MIN, 5, 5},
                                      {0, 0, INT_MAX, INT_MAX}}) {
        request.region = region;
        refused({"region"});
    }
    request.region = {};
    Frame yuv(width, height, VIRGA_YUV420, VIRGA_UINT8);
    yuv.picture.window.x = 1;
    request.plate = &yuv.picture;
    refused({"plate", "share chroma"});
    request.plate = &plate.picture;
    yuv.picture.window.x = 0;
    request.beauty = &yuv.picture;
    request.region = {1, 0, 8, 8};
    refused({"beauty", "share chroma", "cut"});
    request.region = {0, 0, 7, 8};
    refused({"cut"});
}

TEST_F(Errors, OfFramesAndScales)
{
    for (const double frame : {double(NAN), double(INFINITY), 1e16, -1e300}) {
        request.frame = frame;
        refused({"frame", "within"});
    }
    request.frame = 0;
    for (const double scale : {-1.0, 1.01, double(NAN), double(INFINITY)}) {
        request.scale = scale;
        refused({"scale", "over 0"});
    }
    int w = 0, h = 0;
    said(virga_shot_frame_size(shot.get(), 2, &w, &h), VIRGA_ERROR_INVALID_ARGUMENT, {"scale 2"});
    // As small as can be.
    EXPECT_EQ(virga_shot_frame_size(shot.get(), 1e-9, &w, &h), VIRGA_OK);
    EXPECT_EQ(w, 1);
    EXPECT_EQ(h, 1);
}

TEST_F(Errors, OfParameters)
{
    said(virga_shot_set(shot.get(), "rat", "1"), VIRGA_ERROR_INVALID_ARGUMENT, {"rat", "did you mean 'rate'"});
    said(virga_shot_set(shot.get(), "rate", "-1"), VIRGA_ERROR_INVALID_ARGUMENT, {"-1", "0 to 2000"});
    const double three[3] = {1, 2, 3}, nan = NAN, half = 0.5;
    said(virga_shot_set_numbers(shot.get(), "wind", three, 3), VIRGA_ERROR_INVALID_ARGUMENT,
         {"wind", "3 numbers", "2"});
    said(virga_shot_set_numbers(shot.get(), "rate", three, 0), VIRGA_ERROR_INVALID_ARGUMENT, {"rate", "0 numbers"});
    said(virga_shot_set_numbers(shot.get(), "rate", &nan, 1), VIRGA_ERROR_INVALID_ARGUMENT, {"rate"});
    said(virga_shot_set_numbers(shot.get(), "seed", &half, 1), VIRGA_ERROR_INVALID_ARGUMENT, {"seed"});
    said(virga_shot_set_numbers(shot.get(), "paper", &half, 1), VIRGA_ERROR_INVALID_ARGUMENT, {"paper", "0 or 1"});
    said(virga_shot_set_numbers(shot.get(), "env", three, 1), VIRGA_ERROR_INVALID_ARGUMENT, {"env", "text"});
    std::size_t count = 0;
    said(virga_shot_get_numbers(shot.get(), "env", nullptr, 0, &count), VIRGA_ERROR_INVALID_ARGUMENT, {"env", "text"});
    said(virga_shot_set_device(shot.get(), "fast"), VIRGA_ERROR_INVALID_ARGUMENT, {"fast", "cpu"});
    std::uint64_t value = 0;
    EXPECT_EQ(virga_counter("sheep", &value), VIRGA_ERROR_INVALID_ARGUMENT);
}

TEST_F(Errors, OfDocumentsChangeNothing)
{
    const auto rate = [&] {
        double value = 0;
        std::size_t count = 0;
        EXPECT_EQ(virga_shot_get_numbers(shot.get(), "rate", &value, 1, &count), VIRGA_OK);
        return value;
    };
    const auto document = [&](const char* text, std::initializer_list<const char*> words, virga_error code) {
        said(virga_shot_set_document(shot.get(), text), code, words);
        EXPECT_EQ(rate(), 80) << text;
    };
    const virga_error input = VIRGA_ERROR_INPUT, argument = VIRGA_ERROR_INVALID_ARGUMENT;
    document("rate = 3\nwind = \"x\"", {"settings, line 2", "wind"}, argument);
    document("rate = 3\nwind =", {"settings, line 2"}, input);
    document("{\"rate\": 3,\n \"rat\": 4}", {"settings", "did you mean 'rate'"}, argument);
    document("{\"rate\": 3,\n", {"settings, line 2", "JSON"}, input);
    document("{\"rate\": {\"x\": 3}}", {"rate"}, argument);
    document("{\"grade\": {\"rate\": 3}}", {"belongs into [rain]"}, argument);
    document("{\"rain\": {\"rain\": {\"rate\": 3}}}", {"rain"}, argument);
    document(("{\"rate\": " + std::string(100000, '[')).c_str(), {"settings"}, input);
}

TEST_F(Errors, SettingsComeBackAsTheyWereSet)
{
    ASSERT_EQ(
        virga_shot_set_document(shot.get(), "\n {\"rain\": {\"rate\": 12.5, \"wind\": [3, -1]}, \"fog\": \"auto\"}"),
        VIRGA_OK);
    ASSERT_EQ(virga_shot_set_document(shot.get(), "[grade]\ndarken = 0.25"), VIRGA_OK);
    double numbers[3] = {};
    std::size_t count = 9;
    ASSERT_EQ(virga_shot_get_numbers(shot.get(), "wind", numbers, 3, &count), VIRGA_OK);
    EXPECT_EQ(count, 2u);
    EXPECT_EQ(numbers[0], 3);
    EXPECT_EQ(numbers[1], -1);
    ASSERT_EQ(virga_shot_get_numbers(shot.get(), "fog", numbers, 3, &count), VIRGA_OK);
    EXPECT_EQ(count, 0u);
    ASSERT_EQ(virga_shot_get_numbers(shot.get(), "wind", numbers, 1, &count), VIRGA_OK);  // less room than numbers
    EXPECT_EQ(count, 2u);
    const double color[3] = {0.5, 0.25, 1}, on = 1;
    ASSERT_EQ(virga_shot_set_numbers(shot.get(), "fog-color", color, 3), VIRGA_OK);
    ASSERT_EQ(virga_shot_set_numbers(shot.get(), "paper", &on, 1), VIRGA_OK);
    ASSERT_EQ(virga_shot_set_numbers(shot.get(), "shutter", nullptr, 0), VIRGA_OK);
    for (const virga_document kind : {VIRGA_TOML, VIRGA_JSON}) {
        const char* text = nullptr;
        ASSERT_EQ(virga_shot_get_document(shot.get(), kind, &text), VIRGA_OK);
        const ShotPointer other = smallShot();
        const std::string all = text;
        ASSERT_EQ(virga_shot_set_document(other.get(), all.c_str()), VIRGA_OK) << virga_error_sentence();
        ASSERT_EQ(virga_shot_get_document(other.get(), kind, &text), VIRGA_OK);
        EXPECT_EQ(all, text);
    }
    // Every row by its own default, as text and as numbers.
    for (std::size_t i = 0; i < virga_parameter_count(); ++i) {
        const virga_parameter& p = *virga_parameter_at(i);
        ASSERT_EQ(virga_shot_set(shot.get(), p.name, p.default_text), VIRGA_OK) << p.name << virga_error_sentence();
        if (p.type == VIRGA_TEXT) continue;
        ASSERT_EQ(virga_shot_set_numbers(shot.get(), p.name, p.default_numbers, p.default_count), VIRGA_OK)
            << p.name << virga_error_sentence();
        const char* text = nullptr;
        ASSERT_EQ(virga_shot_get(shot.get(), p.name, &text), VIRGA_OK);
        EXPECT_STREQ(text, p.default_text) << p.name;
    }
}

// What is missing is said when it is needed; the shot goes on with other settings.
TEST_F(Errors, OfFilesComeWithTheFrame)
{
    ASSERT_EQ(virga_shot_set(shot.get(), "env", "gone.exr"), VIRGA_OK);
    said(virga_shot_render(shot.get(), &request), VIRGA_ERROR_INPUT, {"gone.exr"});
    ASSERT_EQ(virga_shot_set(shot.get(), "env", ""), VIRGA_OK);
    ASSERT_EQ(virga_shot_set(shot.get(), "depth", "gone.exr"), VIRGA_OK);
    said(virga_shot_render(shot.get(), &request), VIRGA_ERROR_INPUT, {"gone.exr"});
    ASSERT_EQ(virga_shot_set(shot.get(), "depth", ""), VIRGA_OK);
    ASSERT_EQ(virga_shot_set(shot.get(), "grade-from", "gone.png"), VIRGA_OK);
    said(virga_shot_render(shot.get(), &request), VIRGA_ERROR_INVALID_ARGUMENT,
         {"grade-from", "virga_shot_add_plate_sample"});
    ASSERT_EQ(virga_shot_add_plate_sample(shot.get(), 0, &plate.picture), VIRGA_OK);
    said(virga_shot_render(shot.get(), &request), VIRGA_ERROR_INPUT, {"gone.png"});
    ASSERT_EQ(virga_shot_set(shot.get(), "grade-from", ""), VIRGA_OK);
    ASSERT_EQ(virga_shot_render(shot.get(), &request), VIRGA_OK) << virga_error_sentence();
    EXPECT_EQ(virga_shot_error(shot.get(), nullptr), VIRGA_OK);
    Frame depth(width, height, VIRGA_GREY);
    std::fill_n(depth.floats(), depth.size(), std::nanf(""));
    request.depth = &depth.picture;
    untouched = beauty.planes();
    said(virga_shot_render(shot.get(), &request), VIRGA_ERROR_INPUT, {"the caller's depth", "none of its"});
}

}  // namespace
}  // namespace virga::test
