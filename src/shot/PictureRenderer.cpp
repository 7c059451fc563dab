#include "shot/PictureRenderer.h"

#include <deque>
#include <optional>
#include <utility>

#include "core/Error.h"
#include "core/Timer.h"
#include "gl/Context.h"
#include "gl/PassTimer.h"
#include "gl/SharedContexts.h"
#include "passes/BlurPass.h"
#include "passes/CompositePass.h"
#include "passes/CpuRenderer.h"
#include "passes/LightPass.h"
#include "passes/PlanesPass.h"
#include "passes/SplashPass.h"
#include "passes/StrokePass.h"

namespace virga::shot {
namespace {

/// A picture that the device is not done with, and what tells of it.
struct PictureOnDevice {
    std::shared_ptr<RowSink> canvas;
    std::unique_ptr<gl::PassTimer> timer;
    gl::MappedBuffer counts;  // of strokes, then of splashes
    DrawnPicture drawn;       // but for the times and counts of the device
};

class ShaderPicture final : public PictureRenderer {
public:
    ShaderPicture(std::shared_ptr<const gl::Context> context, const PictureSetup& setup)
        : context_(std::move(context)), features_(setup.features), shaderFolder_(setup.shaderFolder)
    {
        context_->makeCurrent();
        features_.software = context_->device().isSoftware;
        targets_.emplace(setup.width, setup.height, features_);
        gl::ShaderPlaces places(setup.shaderFolder);
        places.programs = KeptFiles(setup.cacheFolder);
        if (features_.rain) strokes_.emplace(features_, setup.atlas, places);
        if (features_.light()) light_.emplace(features_, places);
        if (features_.splashes) splashes_.emplace(features_, places);
        if (features_.blur) blur_.emplace(features_, places);
        composite_.emplace(features_, places);
        if (features_.lights) targets_->uploadRingTransfer(setup.ringTransfer);
        if (features_.colorTransfer) targets_->uploadLut(setup.lut.size, setup.lut.rgb);
        context_->check("opening the passes");
    }

    ~ShaderPicture() override { context_->tryMakeCurrent(); }

    bool isOpenGl() const override { return true; }
    std::string device() const override { return context_->device().renderer; }
    void resize(int width, int height) override
    {
        targets_->resize(width, height);
        planesIn_.reset();
        planesOut_.reset();
        keepsPlate_ = false;
    }
    std::size_t bytes() const override
    {
        return targets_->bytes() + (strokes_ ? strokes_->bytes() : 0) + (splashes_ ? splashes_->bytes() : 0);
    }
    void keepPlate() override { keepsPlate_ = true; }
    bool takesRows() const override { return true; }
    std::size_t picturesInFlight() const override { return passes::transfersInFlight - 1; }
    void setDepth(ConstImageViewF metres) override { here().uploadDepth(metres); }
    void setFogTable(const std::vector<float>& opticalDepth) override { here().uploadFogTable(opticalDepth); }
    void setVeilTable(const std::vector<float>& sums) override { here().uploadVeilTable(sums); }
    void setLamps(std::span<const shared::PointLight> lamps) override { here().uploadLights(lamps); }
    void setDropRadiance(ConstImageViewF radiance, ConstImageViewF lowPassBackground) override
    {
        here().uploadDropRadiance(radiance, lowPassBackground);
    }

    DrawnPicture render(PlateInput plate, const shared::FrameConstants& constants, const particles::CellList& cells,
                        const glm::mat3& environmentFromWorld, const Watch& watch) override
    {
        context_->makeCurrent();
        PictureOnDevice picture = newPicture();
        DrawnPicture& drawn = picture.drawn;
        gl::PassTimer& timer = *picture.timer;
        const auto timed = [&](const char* name, auto&& work) {
            const Timer clock;
            work();
            drawn.passMs[name] += clock.milliseconds();
        };
        timer.begin();
        timed("upload", [&] {
            if (!std::exchange(keepsPlate_, false)) upload(plate);
            shared::FrameConstants described = constants;
            if (strokes_) strokes_->describe(described, cells);
            targets_->setConstants(described);
        });
        targets_->bind();
        const auto mark = [&](const char* name) { timer.mark(name); };
        mark("to light");
        if (light_) light_->run(*targets_, environmentFromWorld), mark("light");
        if (blur_) blur_->run(*targets_), mark("blur");
        if (splashes_) splashes_->run(*targets_), mark("splashes");
        if (strokes_) strokes_->run(*targets_, cells, timer);
        composite_->run(*targets_);
        mark("composite");
        if (strokes_) strokes_->copyCount(picture.counts.name(), 0);
        if (splashes_) splashes_->copyCount(picture.counts.name(), splashesAt);
        picture.canvas = plate.canvas;
        if (plate.canvas) {
            putOnto(*plate.canvas, drawn);
            mark("to codes");
            context_->check("rendering");
            onDevice_.push_back(std::move(picture));
            return {};
        }
        tell(watch, 0.5);
        timed("read-back", [&] { readBack(drawn); });
        context_->check("rendering");
        return completed(std::move(picture));
    }

    DrawnPicture complete() override
    {
        context_->makeCurrent();
        PictureOnDevice picture = std::move(onDevice_.front());
        onDevice_.pop_front();
        const Timer clock;
        const auto codes = picture.canvas->codes();
        if (codes && passes::convertsOnDevice(codes->format)) planesOut_->finish(*codes);
        picture.drawn.passMs["read-back"] += clock.milliseconds();
        return completed(std::move(picture));
    }

private:
    /// The targets, with the context current that they are of.
    passes::FrameTargets& here()
    {
        context_->makeCurrent();
        return *targets_;
    }

    /// With the timer and the buffer of an earlier one, if one is done.
    PictureOnDevice newPicture()
    {
        PictureOnDevice picture;
        if (!done_.empty()) {
            picture = std::move(done_.back());
            done_.pop_back();
            return picture;
        }
        picture.timer = std::make_unique<gl::PassTimer>();
        picture.counts =
            gl::MappedBuffer(splashesAt + passes::SplashPass::countBytes, gl::MappedBuffer::Way::FromDevice);
        return picture;
    }

    void upload(const PlateInput& plate)
    {
        const auto codes = plate.rows ? plate.rows->codes() : std::nullopt;
        if (!codes || !passes::convertsOnDevice(codes->format)) {
            targets_->uploadPlate(plate.rows ? wholePicture(*plate.rows) : plate.pixels);
            return;
        }
        if (!planesIn_ || !planesIn_->fits(*codes)) planesIn_.emplace(*codes, shaderFolder_);
        planesIn_->run(*codes, *targets_);
    }

    /// As codes, by the device and once complete() is called, or as light at once.
    void putOnto(RowSink& canvas, DrawnPicture& drawn)
    {
        const auto codes = canvas.codes();
        if (!codes || !passes::convertsOnDevice(codes->format)) {
            readBack(drawn);
            writePicture(drawn.beauty, canvas);
            drawn.beauty = {};
            return;
        }
        if (!planesOut_) planesOut_.emplace(*codes, shaderFolder_);
        planesOut_->run(*targets_);
    }

    /// What the device says of a picture that it is done with.
    DrawnPicture completed(PictureOnDevice picture)
    {
        DrawnPicture drawn = std::move(picture.drawn);
        for (const auto& [name, ms] : picture.timer->collect()) drawn.passMs[name] += ms;
        if (strokes_) drawn.strokes = passes::StrokePass::strokesIn(picture.counts.data());
        if (splashes_) drawn.splashes = passes::SplashPass::splashesIn(picture.counts.data() + splashesAt);
        picture.canvas = nullptr;
        picture.drawn = {};
        done_.push_back(std::move(picture));
        return drawn;
    }

    void readBack(DrawnPicture& drawn) const
    {
        using Layer = passes::FrameTargets::LayerIndex;
        drawn.beauty = targets_->readBeauty();
        if (features_.layers) {
            if (features_.rain) drawn.rain = targets_->readLayer(Layer::Rain);
            if (features_.splashes) drawn.splash = targets_->readLayer(Layer::Splash);
            if (features_.fog) drawn.fog = targets_->readLayer(Layer::Fog);
            drawn.plate = targets_->readLayer(Layer::Plate);
        }
        if (features_.nearest) {
            drawn.nearestDepth = targets_->readNearestDepth();
            drawn.nearestMotion = targets_->readNearestMotion();
        }
    }

    static constexpr std::size_t splashesAt = passes::StrokePass::countBytes;

    // Destroyed in reverse order: GL objects before their context.
    std::shared_ptr<const gl::Context> context_;
    passes::Features features_;
    std::string shaderFolder_;
    std::optional<passes::FrameTargets> targets_;
    std::optional<passes::LightPass> light_;
    std::optional<passes::StrokePass> strokes_;
    std::optional<passes::SplashPass> splashes_;
    std::optional<passes::BlurPass> blur_;
    std::optional<passes::CompositePass> composite_;
    bool keepsPlate_ = false;
    std::optional<passes::PlanesIn> planesIn_;
    std::optional<passes::PlanesOut> planesOut_;
    std::deque<PictureOnDevice> onDevice_;  // oldest first
    std::vector<PictureOnDevice> done_;     // to be used again
};

class CpuPicture final : public PictureRenderer {
public:
    explicit CpuPicture(const PictureSetup& setup)
        : renderer_(setup.width, setup.height, setup.features, setup.atlas), hasBlur_(setup.features.blur)
    {
        if (setup.features.lights) renderer_.setRingTransfer(setup.ringTransfer);
        if (setup.features.colorTransfer) renderer_.setLut(setup.lut.rgb);
    }

    bool isOpenGl() const override { return false; }
    std::string device() const override { return "processor, without OpenGL"; }
    void resize(int width, int height) override { renderer_.resize(width, height); }
    std::size_t bytes() const override { return renderer_.bytes(); }
    void keepPlate() override {}  // it draws over the plate
    bool takesRows() const override { return !hasBlur_; }
    void setDepth(ConstImageViewF metres) override { renderer_.setDepth(metres); }
    void setFogTable(const std::vector<float>& opticalDepth) override { renderer_.setFogTable(opticalDepth); }
    void setVeilTable(const std::vector<float>& sums) override { renderer_.setVeilTable(sums); }
    void setLamps(std::span<const shared::PointLight> lamps) override { renderer_.setLamps(lamps); }
    void setDropRadiance(ConstImageViewF radiance, ConstImageViewF lowPassBackground) override
    {
        renderer_.setDropRadiance(radiance, lowPassBackground);
    }

    DrawnPicture render(PlateInput plate, const shared::FrameConstants& constants, const particles::CellList& cells,
                        const glm::mat3& environmentFromWorld, const Watch& watch) override
    {
        DrawnPicture drawn;
        renderer_.setWatch(watch);
        if (plate.rows) {
            renderer_.render(*plate.rows, *plate.canvas, constants, cells, environmentFromWorld);
        } else {
            renderer_.render(plate.pixels.view(), constants, cells, environmentFromWorld);
            if (plate.canvas)
                writePicture(plate.pixels, *plate.canvas);
            else
                drawn.beauty = std::move(plate.pixels);
        }
        drawn.rain = renderer_.takeRain();
        drawn.splash = renderer_.takeSplash();
        drawn.fog = renderer_.takeFog();
        drawn.plate = renderer_.takePlate();
        drawn.nearestDepth = renderer_.takeNearestDepth();
        drawn.nearestMotion = renderer_.takeNearestMotion();
        drawn.strokes = renderer_.strokeCount();
        drawn.splashes = renderer_.splashCount();
        drawn.passMs = renderer_.passMs();
        return drawn;
    }

private:
    passes::CpuRenderer renderer_;
    bool hasBlur_;
};

/// Null if there is none.
std::shared_ptr<const gl::Context> openGpu()
{
    try {
        return gl::SharedContexts::open("gpu");
    } catch (const Error& error) {
        if (error.code() != ErrorCode::Graphics) throw;
        return nullptr;
    }
}

}  // namespace

std::unique_ptr<PictureRenderer> makePictureRenderer(const PictureSetup& setup)
{
    const bool byShaders = !setup.shaderFolder.empty();
    if (setup.device == "cpu" && !byShaders) return std::make_unique<CpuPicture>(setup);
    if (setup.device == "auto" && !byShaders) {
        if (auto gpu = openGpu()) return std::make_unique<ShaderPicture>(std::move(gpu), setup);
        return std::make_unique<CpuPicture>(setup);
    }
    return std::make_unique<ShaderPicture>(gl::SharedContexts::open(setup.device), setup);
}

}  // namespace virga::shot
