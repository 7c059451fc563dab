// A region is the crop of the whole picture, and a smaller scale is the whole picture reduced.
#include "shot/View.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/Error.h"
#include "shot/Compositor.h"
#include "support/Files.h"

namespace virga::shot {
namespace {

using test::TemporaryFolder;

constexpr int width = 320, height = 180;

/// A street's light: a sky, a wall with a door in it, noise of a few pixels.
ImageF plateOf(int w, int h)
{
    ImageF plate(w, h, 4, 1.0f);
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            const double u = (x + 0.5) / w, v = (y + 0.5) / h;
            const double base = v < 0.4 ? 0.8 : u > 0.4 && u < 0.5 && v > 0.5 ? 0.02 : 0.15;
            for (int c = 0; c < 3; ++c)
                plate.at(x, y, c) = float(base * (1 + 0.1 * c) * (1 + 0.2 * std::sin(40 * u) * std::cos(30 * v)));
        }
    return plate;
}

Settings rainOnGround()
{
    Settings s;
    s.rate_mm_h = 60;
    s.wind_m_s = {3, 1};
    s.ground = "1.6,4";
    s.blur_px = 1.5;
    s.fov_deg = 55;
    s.envFrames = 0;
    return s;
}

PlateSamples samplesOf(const ImageF& plate)
{
    PlateSamples samples;
    samples.forLight.push_back({0, plate});
    return samples;
}

struct Rendered {
    ImageF beauty;
    std::vector<io::Layer> layers;
};

class Renderer {
public:
    explicit Renderer(const Settings& settings, const std::string& device = "cpu")
        : plate_(plateOf(width, height)), compositor_(settings, {width, height, 24, 0},
                                                      {.wanted = {.layers = true}, .device = device}, samplesOf(plate_))
    {
    }
    Rendered operator()(const View& view, FrameNumber frame = 7)
    {
        io::PlateFrame plate;
        plate.number = frame;
        const Window given = view.plate.isEmpty() ? Window{0, 0, width, height} : view.plate;
        plate.pixels = view.scale == 1 ? placed(plate_, {0, 0, width, height}, given) : reduced(view.scale);
        io::RenderedFrame rendered = compositor_.render(std::move(plate), view, {});
        return {std::move(rendered.beauty), std::move(rendered.layers)};
    }
    ImageF reduced(double scale) const
    {
        const int by = int(std::lround(1 / scale));
        return mean(plate_, by);
    }
    static ImageF mean(const ImageF& image, int by)
    {
        ImageF small(image.width() / by, image.height() / by, image.channels());
        for (int y = 0; y < small.height() * by; ++y)
            for (int x = 0; x < small.width() * by; ++x)
                for (int c = 0; c < image.channels(); ++c)
                    small.at(x / by, y / by, c) += image.at(x, y, c) / float(by * by);
        return small;
    }
    Compositor& compositor() { return compositor_; }

private:
    ImageF plate_;
    Compositor compositor_;
};

double greatestDifference(const ImageF& a, const ImageF& b)
{
    EXPECT_EQ(a.size(), b.size());
    double greatest = 0;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
        greatest = std::max(greatest, std::abs(double(a.data()[i]) - double(b.data()[i])));
    return greatest;
}

double rms(const ImageF& a, const ImageF& b)
{
    EXPECT_EQ(a.size(), b.size());
    double sum = 0;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
        sum += std::pow(double(a.data()[i]) - double(b.data()[i]), 2);
    return std::sqrt(sum / double(a.size()));
}

double meanOf(const ImageF& image, int channel)
{
    double sum = 0;
    for (std::size_t i = std::size_t(channel); i < image.size(); i += 4) sum += double(image.data()[i]);
    return 4 * sum / double(image.size());
}

const Window parts[] = {{0, 0, 64, 64},     {16, 32, 64, 48}, {131, 77, 93, 61},
                        {300, 150, 20, 30}, {159, 90, 1, 1},  {0, 100, width, 13}};

void expectCrops(Renderer& renderer)
{
    const Window frame{0, 0, width, height};
    const Rendered whole = renderer({});
    for (const Window& part : parts) {
        SCOPED_TRACE(testing::Message() << part.x << "," << part.y << " " << part.width << "x" << part.height);
        const Rendered made = renderer({.region = part});
        // What is on the picture is the same; places that are counted from another corner round to other floats. A
        // splash ends where it is fainter than 0.002, here or a pixel farther.
        const ImageF expected = placed(whole.beauty, frame, part);
        EXPECT_LT(greatestDifference(made.beauty, expected), 5e-3);
        EXPECT_LT(rms(made.beauty, expected), 1e-4);
        ASSERT_EQ(made.layers.size(), whole.layers.size());
        for (std::size_t i = 0; i < 4; ++i)
            EXPECT_LT(greatestDifference(made.layers[i].pixels, placed(whole.layers[i].pixels, frame, part)),
                      made.layers[i].name == "splash" ? 5e-3 : 2e-4)
                << made.layers[i].name;
    }
    // Nothing of a part stays.
    EXPECT_EQ(greatestDifference(renderer({}).beauty, whole.beauty), 0);
}

TEST(View, RegionIsACropOfTheWhole)
{
    Renderer renderer(rainOnGround());
    expectCrops(renderer);
}

TEST(View, RegionIsACropOfTheWholeByShaders)
{
    Renderer renderer(rainOnGround(), "0");  // of whatever kind it is
    expectCrops(renderer);
}

/// A host says that the plate is the one before; another part of it has to be uploaded all the same.
TEST(View, AnotherPartOfTheSamePlate)
{
    for (const char* device : {"cpu", "0"}) {
        Compositor compositor(rainOnGround(), {width, height, 24, 0}, {.wanted = {}, .device = device},
                              samplesOf(plateOf(width, height)));
        const auto render = [&](const View& view, std::uint64_t content) {
            io::PlateFrame plate;
            plate.number = 7;
            plate.content = content;
            plate.pixels = plateOf(width, height);
            return compositor.render(std::move(plate), view, {}).beauty;
        };
        const ImageF whole = render({}, 5);
        const Window part{64, 48, 96, 64};
        EXPECT_LT(rms(render({.region = part}, 5), placed(render({}, 0), {0, 0, width, height}, part)), 1e-4) << device;
        EXPECT_EQ(greatestDifference(render({}, 5), whole), 0) << device;
    }
}

TEST(View, RegionIsACropWithDepthImagesNearDropsAndACameraThatMoves)
{
    const TemporaryFolder folder;
    Settings s = rainOnGround();
    s.ground.clear();
    ImageF depth(width, height, 1);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) depth.at(x, y) = x < 140 ? 4.0f : 1.0f + 0.2f * float(y);
    s.depth = folder / "depth.exr";
    io::writeExr(s.depth, depth, {"Z"}, false);
    s.fstop = 1.4;
    s.near_m = 0.05;
    s.camera = folder.write("track.chan", "0 0 1.6 0 -4 0 0 30\n20 0.4 1.6 -2 -4 9 0 33\n");
    Renderer renderer(s);
    expectCrops(renderer);
}

/// The plate need not reach farther than what a blur spreads into the region.
TEST(View, TakesAPartOfThePlate)
{
    Renderer renderer(rainOnGround());
    const Window part{100, 60, 40, 30};
    const Rendered whole = renderer({});
    const Window needed = renderer.compositor().plateNeededFor({.region = part});
    EXPECT_TRUE(needed.contains(part));
    EXPECT_LT(needed.width, part.width + 20);
    const Rendered made = renderer({.region = part, .plate = needed});
    EXPECT_LT(greatestDifference(made.beauty, placed(whole.beauty, {0, 0, width, height}, part)), 2e-4);
    EXPECT_THROW(renderer({.region = part, .plate = part}), Error);
}

TEST(View, LightOfEachFrameNeedsItsWholePlate)
{
    Compositor compositor(rainOnGround(), {width, height, 24, 0}, {.wanted = {}, .device = "cpu"}, {});
    EXPECT_TRUE(compositor.needsWholePlate());
    io::PlateFrame plate;
    plate.pixels = plateOf(64, 64);
    EXPECT_THROW(compositor.render(std::move(plate), {.region = {16, 16, 8, 8}, .plate = {0, 0, 64, 64}}, {}), Error);
}

/// Means over the reduced picture's pixels of the whole are what the reduced picture has: the same drops, in the same
/// places, as dense. What differs is that a pixel's strokes blend before or after the mean is taken, and the light's
/// grid.
TEST(View, HalfScaleIsTheWholeReduced)
{
    for (const char* ground : {"", "1.6,4"}) {
        Settings s = rainOnGround();
        s.ground = ground;
        Renderer renderer(s);
        const Rendered whole = renderer({});
        for (const int by : {2, 4}) {
            SCOPED_TRACE(testing::Message() << "1/" << by << " on '" << ground << "'");
            const Rendered small = renderer({.scale = 1.0 / by});
            const ImageF rain = Renderer::mean(whole.layers[0].pixels, by);
            const ImageF expected = Renderer::mean(whole.beauty, by);
            EXPECT_NEAR(meanOf(small.layers[0].pixels, 3) / meanOf(rain, 3), 1, 0.001);
            EXPECT_LT(rms(small.layers[0].pixels, rain), 0.002);
            EXPECT_LT(rms(small.beauty, expected), by == 2 ? 0.005 : 0.015) << "of a mean of 0.4; most is the blur's";
            // It is the same rain, not one that looks like it.
            Renderer other([&] {
                Settings o = s;
                o.seed = 2;
                return o;
            }());
            EXPECT_GT(rms(other({.scale = 1.0 / by}).layers[0].pixels, rain), 2 * rms(small.layers[0].pixels, rain));
        }
    }
}

TEST(View, AFrameHasAPixelAtLeast)
{
    EXPECT_EQ(frameAt(64, 48, 0.001), (Window{0, 0, 1, 1}));
    EXPECT_EQ(frameAt(961, 541, 0.5), (Window{0, 0, 481, 271}));
    EXPECT_EQ(frameAt(16384, 1, 1), (Window{0, 0, 16384, 1}));
}

TEST(View, ProxyOfAPlateIsItsMean)
{
    const ImageF plate = plateOf(width, height);
    EXPECT_LT(greatestDifference(proxyOf(plate, 0.5), Renderer::mean(plate, 2)), 1e-6);
    EXPECT_EQ(greatestDifference(proxyOf(plate, 1), plate), 0);
    for (const double scale : {0.9, 0.37, 0.001}) {
        const ImageF flat = proxyOf(ImageF(61, 33, 4, 0.25f), scale);
        EXPECT_EQ(flat.width(), std::max(1L, std::lround(61 * scale)));
        for (const float v : flat.values()) ASSERT_NEAR(v, 0.25f, 1e-5) << scale;
    }
}

TEST(View, RegionOfAProxyIsItsCrop)
{
    Renderer renderer(rainOnGround());
    const Rendered whole = renderer({.scale = 0.5});
    const Window part{50, 30, 60, 41};
    const Rendered made = renderer({.scale = 0.5, .region = part});
    EXPECT_LT(greatestDifference(made.beauty, placed(whole.beauty, {0, 0, width / 2, height / 2}, part)), 2e-4);
}

TEST(View, RefusesWhatIsNone)
{
    const Window frame{0, 0, 64, 48};
    for (const double scale : {0.0, -1.0, 1.5, double(NAN)})
        EXPECT_THROW(windowsOf({.scale = scale}, frame, 0, 0), Error);
    for (const Window& w : {Window{0, 0, -3, 4}, Window{0, 0, 4, 0}, Window{0, 0, 20000, 4}, Window{1 << 30, 0, 4, 4}})
        EXPECT_THROW(windowsOf({.region = w}, frame, 0, 0), Error) << w.x << " " << w.width;
}

TEST(View, WindowsLineUpWithTheFramesGrids)
{
    const Window frame{0, 0, 640, 480};
    const ViewWindows w = windowsOf({.region = {133, 50, 40, 30}}, frame, 7, 0);
    EXPECT_EQ(w.needed, (Window{126, 43, 54, 44}));
    EXPECT_EQ(w.drawn.x % 16, 0);
    EXPECT_EQ(w.drawn.y % 16, 0);
    EXPECT_TRUE(w.drawn.contains(w.needed));
    EXPECT_EQ(windowsOf({}, frame, 7, 30).drawn, frame);
    const Window beyond{-20, -10, 680, 500};
    EXPECT_EQ(windowsOf({.region = beyond}, frame, 7, 30).drawn, beyond);
}

/// As large as OpenGL allows, by parts: what is kept is as large as the part.
TEST(View, OnePixelAndTheLargestFrameByRegion)
{
    Settings s;
    s.rate_mm_h = 5;
    s.threshold = 0.1;
    s.ground = "1.6";
    for (const int side : {1, 16384}) {
        Compositor compositor(s, {side, side, 24, 0}, {.wanted = {}, .device = "cpu"}, samplesOf(plateOf(32, 32)));
        const Window part{side / 2, side / 2, std::min(side, 64), std::min(side, 64)};
        io::PlateFrame plate;
        plate.pixels = ImageF(part.width, part.height, 4, 0.5f);
        const io::RenderedFrame made = compositor.render(std::move(plate), {.region = part, .plate = part}, {});
        EXPECT_EQ(made.beauty.width(), part.width);
        for (const float v : made.beauty.values()) ASSERT_TRUE(std::isfinite(v) && v >= 0);
        EXPECT_LT(compositor.statistics().rendererBytes, 256u << 20) << "of each thread some; the frame would be 4 GB";
    }
}

/// Half a frame later the drops have fallen by half of what they fall from frame to frame: at twice the rate of frames
/// it is the frame between.
TEST(View, BetweenFrames)
{
    Settings s = rainOnGround();
    s.exposure_s = 1.0 / 200;
    Renderer renderer(s);
    const ImageF between = renderer({.later = 0.5}).beauty;
    Compositor twice(s, {width, height, 48, 0}, {.wanted = {.layers = true}, .device = "cpu"},
                     samplesOf(plateOf(width, height)));
    io::PlateFrame plate;
    plate.number = 15;
    plate.pixels = plateOf(width, height);
    EXPECT_EQ(greatestDifference(twice.render(std::move(plate)).beauty, between), 0);
    EXPECT_THROW(renderer({.later = 1}), Error);
}

TEST(View, EndsWhenNobodyWantsIt)
{
    Renderer renderer(rainOnGround());
    const Rendered whole = renderer({});
    for (const double until : {0.0, 0.25, 0.6}) {
        io::PlateFrame plate;
        plate.number = 7;
        plate.pixels = plateOf(width, height);
        double last = -1;
        const Watch watch = [&](double done) {
            EXPECT_GE(done, last);
            last = done;
            return done < until;
        };
        try {
            renderer.compositor().render(std::move(plate), {}, watch);
            FAIL() << "rendered to its end";
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::Interrupted);
        }
    }
    EXPECT_EQ(greatestDifference(renderer({}).beauty, whole.beauty), 0);
}

}  // namespace
}  // namespace virga::shot
