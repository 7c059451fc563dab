// Frames a second from the decoder's planes to the encoder's, without either: planes up, rain, planes down, on this
// machine's device, beside the same with float pictures.
//   bench_pictures [--device auto|cpu|gpu|N] [--frames N] [--size WxH] [--strokes N]
// Prints the machine, then a line a way: float pictures; planes, one frame at a time; planes, several in flight.
// Wall-clock time a frame, of which waiting for the device, and the time of all processors.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

#include "core/Error.h"
#include "core/Timer.h"
#include "gl/Context.h"
#include "gl/PassTimer.h"
#include "matte/OscillatingDrops.h"
#include "particles/RainField.h"
#include "passes/CompositePass.h"
#include "passes/LightPass.h"
#include "passes/PlanesPass.h"
#include "passes/StrokePass.h"

namespace {

using namespace virga;

struct Options {
    std::string device = "auto";
    int frames = 200, width = 1920, height = 1080;
    double strokes = 300e3;
};

double cpuSeconds()
{
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

/// An 8-bit 4:2:0 picture with its memory, as a decoder gives it.
struct Yuv420 {
    Yuv420(int width, int height)
    {
        const int sizes[][2] = {
            {width, height}, {(width + 1) / 2, (height + 1) / 2}, {(width + 1) / 2, (height + 1) / 2}};
        for (std::size_t p = 0; p < 3; ++p) {
            stored[p].resize(std::size_t(sizes[p][0]) * std::size_t(sizes[p][1]));
            for (std::size_t i = 0; i < stored[p].size(); ++i) stored[p][i] = std::uint8_t(90 + i % 61);
        }
        picture.width = width;
        picture.height = height;
        for (std::size_t p = 0; p < 3; ++p) {
            picture.planes[p] = stored[p].data();
            picture.strides[p] = sizes[p][0];
        }
    }
    CodedPlanes coded() const
    {
        CodedPlanes planes;
        planes.format = {PlanarFormat::Family::Yuv, 8, 1, 1, false};
        planes.curve = {2.4, 0.055, 12.92, 0.04045};  // sRGB
        planes.picture = picture;
        return planes;
    }
    ConstCodedPlanes constCoded() const
    {
        const CodedPlanes from = coded();
        ConstCodedPlanes planes{from.format, from.coding, from.chroma, from.curve, {}};
        planes.picture.width = picture.width;
        planes.picture.height = picture.height;
        planes.picture.strides = picture.strides;
        for (std::size_t p = 0; p < 3; ++p) planes.picture.planes[p] = picture.planes[p];
        return planes;
    }

    std::array<std::vector<std::uint8_t>, 3> stored;
    PlanarPicture picture;
};

/// The passes of a rain with fog; its cells are listed once, as the processor's work on them is not what is measured.
class Rain {
public:
    Rain(const Options& o, const gl::Context& context)
        : features_(featuresOn(context)), targets(o.width, o.height, features_)
    {
        const rainfall::DropSizes sizes(25);
        const particles::Motion motion({.wind = {0.8, 0.0}, .gust = 0.3, .turbulence = 0.25});
        particles::Exposure exposure;
        exposure.duration_s = 1 / 200.0;
        exposure.projection = camera::projectionFromHorizontalFov(o.width, o.height, 60 * 3.14159265 / 180);
        const particles::Visibility visibility{.near_m = 0.5, .far_m = 500, .threshold = 0.002};
        const particles::RainField plain(rainfall::makeSizeClasses(sizes), sizes.slope(), motion, 1);
        const double scale = o.strokes / plain.expectedStrokes(exposure.projection, exposure.duration_s, visibility);
        const particles::RainField field(rainfall::makeSizeClasses(sizes), sizes.slope(), motion, 1, scale,
                                         particles::RainField::dropsPerCellFor(o.strokes));
        cells_ = field.cellsInView(exposure, visibility);
        constants_.cameraFromWorldOpen = constants_.cameraFromWorldClose = glm::mat4(1.0f);
        const auto focal = float(exposure.projection.focal_px);
        constants_.lens = {focal, focal, 0.5f * float(o.width), 0.5f * float(o.height)};
        constants_.range = {0.5f, 500.0f, 0.002f, 1.0f};
        constants_.focus = {0.0f, 0.1f, float(exposure.duration_s), 20.0f};
        constants_.picture = {o.width, o.height, 0, 0};
        constants_.boost = {0, 0, 0.1f, focal};
        const ImageF white(64, 32, 3, 0.9f);
        targets.uploadFogTable(std::vector<float>(256, 0.05f));
        targets.uploadDropRadiance(white, white);
    }

    void draw()
    {
        shared::FrameConstants constants = constants_;
        strokes_.describe(constants, cells_);
        targets.setConstants(constants);
        targets.bind();
        timer_.begin();
        light_.run(targets);
        strokes_.run(targets, cells_, timer_);
        composite_.run(targets);
    }

private:
    static passes::Features featuresOn(const gl::Context& context)
    {
        passes::Features features;
        features.rain = features.fog = true;
        features.software = context.device().isSoftware;
        return features;
    }

    passes::Features features_;

public:
    passes::FrameTargets targets;

private:
    passes::StrokePass strokes_{features_, matte::makeOscillatingDropAtlas(1)};
    passes::LightPass light_{features_};
    passes::CompositePass composite_{features_};
    particles::CellList cells_;
    shared::FrameConstants constants_{};
    gl::PassTimer timer_;
};

/// frame(): one more frame; returns the seconds that it waited. finish(): what is on its way arrives.
void measure(const char* name, const Options& o, const std::function<double()>& frame,
             const std::function<void()>& finish)
{
    constexpr int warmUp = 5;
    for (int f = 0; f < warmUp; ++f) frame();
    finish();
    double waited = 0;
    const double cpu = cpuSeconds();
    const Timer timer;
    for (int f = 0; f < o.frames; ++f) waited += frame();
    finish();
    const double seconds = timer.seconds(), perFrame = 1e3 / o.frames;
    std::printf("%-26s %8.1f frames/s  %7.3f ms a frame  waiting %7.3f ms  all processors %7.3f ms\n", name,
                o.frames / seconds, perFrame * seconds, perFrame * waited, perFrame * (cpuSeconds() - cpu));
}

void run(const Options& o, const gl::Context& context)
{
    Rain rain(o, context);
    const Yuv420 plate(o.width, o.height), result(o.width, o.height);
    const ImageF light(o.width, o.height, 4, 0.2f);

    measure(
        "float pictures", o,
        [&] {
            rain.targets.uploadPlate(light);
            rain.draw();
            const Timer timer;
            const ImageF beauty = rain.targets.readBeauty();
            return timer.seconds();
        },
        [] {});

    passes::PlanesIn in(plate.constCoded());
    passes::PlanesOut out(result.coded());
    std::size_t onTheirWay = 0;
    const auto receive = [&] {
        const Timer timer;
        out.finish(result.coded());
        --onTheirWay;
        return timer.seconds();
    };
    const auto frameOf = [&](std::size_t inFlight) {
        return [&, inFlight] {
            in.run(plate.constCoded(), rain.targets);
            rain.draw();
            out.run(rain.targets);
            ++onTheirWay;
            double waited = 0;
            while (onTheirWay >= inFlight) waited += receive();
            return waited;
        };
    };
    const auto finish = [&] {
        while (onTheirWay > 0) receive();
    };
    measure("planes, one at a time", o, frameOf(1), finish);
    measure("planes, three in flight", o, frameOf(passes::transfersInFlight), finish);
    context.check("bench_pictures");
}

}  // namespace

int main(int argc, char** argv)
try {
    Options options;
    for (int i = 1; i + 1 < argc; i += 2) {
        const std::string flag = argv[i];
        if (flag == "--device") options.device = argv[i + 1];
        if (flag == "--frames") options.frames = std::max(1, std::atoi(argv[i + 1]));
        if (flag == "--strokes") options.strokes = std::max(1.0, std::atof(argv[i + 1]));
        if (flag == "--size" && std::sscanf(argv[i + 1], "%dx%d", &options.width, &options.height) != 2)
            throw Error(ErrorCode::InvalidArgument, "--size '{}': must be like 1920x1080", argv[i + 1]);
    }
    const gl::Context context(options.device);
    std::printf("%s, OpenGL %s, %dx%d, %.0f strokes\n", context.device().renderer.c_str(),
                context.device().version.c_str(), options.width, options.height, options.strokes);
    run(options, context);
    return 0;
} catch (const virga::Error& error) {
    std::fprintf(stderr, "bench_pictures: %s\n", error.what());
    return virga::exitCode(error.code());
}
