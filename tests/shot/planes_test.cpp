// Planes of codes through the device: what io/Yuv.h does on the processor.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

#include "gl/Context.h"
#include "io/ColorConversion.h"
#include "io/Yuv.h"
#include "passes/CompositePass.h"
#include "passes/PlanesPass.h"

namespace virga::passes {
namespace {

using Family = PlanarFormat::Family;
constexpr int width = 37, height = 29;  // the last word, and the last chroma sample, are not full

/// Planes with their memory; rows have some bytes more than they need.
struct Planes {
    explicit Planes(const PlanarFormat& f) : format(f)
    {
        picture.width = width;
        picture.height = height;
        for (int p = 0; p < f.planes(); ++p) {
            const bool isChroma = f.family == Family::Yuv && (p == 1 || p == 2);
            columns[std::size_t(p)] = isChroma ? (width + (1 << f.chromaShiftX) - 1) >> f.chromaShiftX : width;
            rows[std::size_t(p)] = isChroma ? (height + (1 << f.chromaShiftY) - 1) >> f.chromaShiftY : height;
            const int stride = columns[std::size_t(p)] * f.bytesPerSample() + 6;
            stored[std::size_t(p)].assign(std::size_t(stride * rows[std::size_t(p)]), 0);
            picture.planes[std::size_t(p)] = stored[std::size_t(p)].data();
            picture.strides[std::size_t(p)] = stride;
        }
    }
    std::uint8_t* sample(int plane, int x, int y)
    {
        return picture.planes[std::size_t(plane)] + y * picture.strides[std::size_t(plane)] +
               x * format.bytesPerSample();
    }
    int at(int plane, int x, int y)
    {
        const std::uint8_t* s = sample(plane, x, y);
        return format.bits > 8 ? s[0] | s[1] << 8 : s[0];
    }
    void fill(std::mt19937& random)
    {
        for (int p = 0; p < format.planes(); ++p)
            for (int y = 0; y < rows[std::size_t(p)]; ++y)
                for (int x = 0; x < columns[std::size_t(p)]; ++x) {
                    // Straight colour under alpha 0 is no colour.
                    const bool isAlpha = format.hasAlpha && p == format.planes() - 1;
                    const int code =
                        std::max(int(random() % (1u << format.bits)), isAlpha ? 1 << (format.bits - 2) : 0);
                    std::uint8_t* s = sample(p, x, y);
                    s[0] = std::uint8_t(code & 255);
                    if (format.bits > 8) s[1] = std::uint8_t(code >> 8);
                }
    }

    PlanarFormat format;
    PlanarPicture picture;
    std::array<int, 4> columns{}, rows{};
    std::array<std::vector<std::uint8_t>, 4> stored;
};

template <class Byte>
BasicPlanarPicture<Byte> viewOf(const PlanarPicture& picture)
{
    BasicPlanarPicture<Byte> view;
    view.width = picture.width;
    view.height = picture.height;
    view.strides = picture.strides;
    for (std::size_t p = 0; p < 4; ++p) view.planes[p] = picture.planes[p];
    return view;
}

const char* const spaces[] = {"sRGB", "Rec.709 camera", "Rec.709 BT.1886", "Linear Rec.709"};

/// Every layout, with one of the curves and matrices, and chroma repeated or by its siting.
struct Case {
    PlanarFormat format;
    YuvCoding coding;
    ChromaFilter chroma;
    const char* space;
};

std::vector<Case> manyCases()
{
    std::vector<Case> cases;
    constexpr YuvCoding codings[] = {
        {0.2126, 0.0722, false}, {0.299, 0.114, true}, {0.2627, 0.0593, false}, {.isYCgCo = true}};
    std::size_t n = 0;
    for (const Family family : {Family::Yuv, Family::Rgb, Family::Grey})
        for (const int bits : {8, 10, 12})
            for (const auto& [sx, sy] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}, {2, 2}})
                for (const bool isSmooth : {false, true}) {
                    if (family != Family::Yuv && (sx + sy > 0 || isSmooth)) continue;
                    const ChromaFilter chroma{{isSmooth, 0}, {isSmooth && n % 2 == 0, 0.5}};
                    cases.push_back({{family, bits, sx, sy, n % 3 == 1}, codings[n % 4], chroma, spaces[n / 4 % 4]});
                    ++n;
                }
    return cases;
}

struct Device {
    gl::Context context{"cpu"};
    FrameTargets targets{width, height, {}};
    CompositePass composite{Features{}};

    void passPlateThrough()
    {
        targets.bind();
        composite.run(targets);
    }
};

shared::FrameConstants constants()
{
    shared::FrameConstants c{};
    c.picture = {width, height, 0, 0};
    c.lights.y = 1;
    return c;
}

TEST(Planes, TheDeviceMakesTheProcessorsLight)
{
    Device device;
    device.targets.setConstants(constants());
    std::mt19937 random(3);
    for (const Case& c : manyCases()) {
        Planes planes(c.format);
        planes.fill(random);
        const auto toLinear = io::makeColorTransform(c.space, "Linear Rec.709");
        const ConstCodedPlanes coded{c.format, c.coding, c.chroma, toLinear->power().value(),
                                     viewOf<const std::uint8_t>(planes.picture)};
        ImageF expected(width, height, 4);
        io::planarToLinear(c.format, c.coding, coded.picture, *toLinear, expected, c.chroma);
        PlanesIn in(coded);
        in.run(coded, device.targets);
        device.passPlateThrough();
        const ImageF light = device.targets.readBeauty();
        // In codes: where the curve is steep a step of light is small.
        const auto toCode = io::makeColorTransform("Linear Rec.709", c.space);
        double worst = 0;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                float a[4], b[4];
                std::copy_n(expected.pixel(x, y), 4, a);
                std::copy_n(light.pixel(x, y), 4, b);
                for (int k = 0; k < 3; ++k) a[k] /= a[3], b[k] /= b[3];
                toCode->apply(&a[0], &a[1], &a[2], 1);
                toCode->apply(&b[0], &b[1], &b[2], 1);
                for (int k = 0; k < 4; ++k) worst = std::max(worst, std::fabs(double(a[k]) - double(b[k])));
            }
        EXPECT_LT(worst * ((1 << c.format.bits) - 1), 0.2)
            << "family " << int(c.format.family) << " bits " << c.format.bits << " shifts " << c.format.chromaShiftX
            << c.format.chromaShiftY << " " << c.space;
    }
}

// The law of no effect: what nobody touched comes back, code for code.
TEST(Planes, UntouchedCodesComeBackThroughTheDevice)
{
    Device device;
    device.targets.setConstants(constants());
    std::mt19937 random(4);
    for (const Case& c : manyCases()) {
        if (c.chroma.x.isInterpolated || c.chroma.y.isInterpolated) continue;
        Planes planes(c.format), back(c.format);
        planes.fill(random);
        const PowerCurve curve = io::makeColorTransform(c.space, "Linear Rec.709")->power().value();
        const ConstCodedPlanes coded{c.format, c.coding, {}, curve, viewOf<const std::uint8_t>(planes.picture)};
        const CodedPlanes result{c.format, c.coding, {}, curve, back.picture};
        PlanesIn in(coded);
        PlanesOut out(result);
        in.run(coded, device.targets);
        device.passPlateThrough();
        out.run(device.targets);
        out.finish(result);
        EXPECT_EQ(planes.stored, back.stored)
            << "family " << int(c.format.family) << " bits " << c.format.bits << " shifts " << c.format.chromaShiftX
            << c.format.chromaShiftY << " alpha " << c.format.hasAlpha << " " << c.space;
    }
}

TEST(Planes, TheDeviceMakesTheProcessorsCodes)
{
    Device device;
    device.targets.setConstants(constants());
    std::mt19937 random(5);
    std::uniform_real_distribution<float> unit(-0.1f, 1.3f);
    for (const Case& c : manyCases()) {
        ImageF light(width, height, 4, 1.0f);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                for (int k = 0; k < 3; ++k) light.at(x, y, k) = unit(random);
        light.at(3, 3, 1) = 40;  // beyond any code
        Planes expected(c.format), made(c.format);
        const auto toCode = io::makeColorTransform("Linear Rec.709", c.space);
        io::linearToPlanar(c.format, c.coding, light, *toCode, expected.picture);
        const CodedPlanes result{c.format, c.coding, {}, toCode->power().value(), made.picture};
        device.targets.uploadPlate(light);
        device.passPlateThrough();
        PlanesOut out(result);
        out.run(device.targets);
        out.finish(result);
        int differ = 0, all = 0;
        for (int p = 0; p < c.format.planes(); ++p)
            for (int y = 0; y < expected.rows[std::size_t(p)]; ++y)
                for (int x = 0; x < expected.columns[std::size_t(p)]; ++x) {
                    const int distance = std::abs(expected.at(p, x, y) - made.at(p, x, y));
                    EXPECT_LE(distance, 1) << p << " " << x << " " << y;  // where half a code is rounded up or down
                    differ += distance != 0;
                    ++all;
                }
        EXPECT_LT(differ, 0.02 * all);
    }
}

// Frames on their way at once do not take each other's places.
TEST(Planes, FramesInFlightKeepTheirOrder)
{
    Device device;
    device.targets.setConstants(constants());
    std::mt19937 random(6);
    const PlanarFormat format{Family::Yuv, 8, 1, 1, false};
    const PowerCurve curve = io::makeColorTransform("sRGB", "Linear Rec.709")->power().value();
    std::vector<Planes> sent;
    std::optional<PlanesIn> in;
    std::optional<PlanesOut> out;
    std::size_t received = 0;
    const auto receive = [&] {
        Planes back(format);
        out->finish({format, {}, {}, curve, back.picture});
        EXPECT_EQ(back.stored, sent[received].stored) << received;
        ++received;
    };
    for (int frame = 0; frame < 8; ++frame) {
        Planes planes(format);
        planes.fill(random);
        const ConstCodedPlanes coded{format, {}, {}, curve, viewOf<const std::uint8_t>(planes.picture)};
        if (!in) in.emplace(coded);
        if (!out) out.emplace(CodedPlanes{format, {}, {}, curve, planes.picture});
        if (sent.size() - received == transfersInFlight) receive();
        in->run(coded, device.targets);
        device.passPlateThrough();
        out->run(device.targets);
        sent.push_back(planes);
    }
    while (received < sent.size()) receive();
}

TEST(Planes, OtherPicturesDoNotFit)
{
    Device device;
    const PlanarFormat format{Family::Yuv, 8, 1, 1, false};
    Planes planes(format);
    const CodedPlanes coded{format, {}, {}, {}, planes.picture};
    const PlanesOut out(coded);
    EXPECT_TRUE(out.fits(coded));
    CodedPlanes other = coded;
    other.coding.fullRange = true;
    EXPECT_FALSE(out.fits(other));
    other = coded;
    other.picture.width = 35;
    EXPECT_FALSE(out.fits(other));
    other = coded;
    other.curve.power = 2.2;
    EXPECT_FALSE(out.fits(other));
    EXPECT_TRUE(convertsOnDevice(format));
    EXPECT_FALSE(convertsOnDevice({Family::Yuv, 16, 1, 1, false}));
}

}  // namespace
}  // namespace virga::passes
