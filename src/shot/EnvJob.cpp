#include "shot/EnvJob.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "camera/Camera.h"
#include "core/Error.h"
#include "core/Log.h"
#include "core/Parallel.h"
#include "core/Timer.h"
#include "environment/DropRadiance.h"
#include "environment/EnvironmentPreview.h"
#include "environment/Highlights.h"
#include "environment/Panorama.h"
#include "environment/PanoramaLayout.h"
#include "environment/Registration.h"
#include "io/AtomicFile.h"
#include "io/ColorConversion.h"
#include "io/ImageFile.h"
#include "io/Plate.h"
#include "sh/Harmonics.h"

namespace virga::shot {
namespace {

using environment::Panorama;
using nlohmann::json;

constexpr double pi = std::numbers::pi;
constexpr double usualFov_deg = 60;
constexpr std::size_t judged = 16;         // frames that decide how the camera moves
constexpr std::size_t joinedAtFirst = 40;  // frames of a pan; where they do not join there are more
constexpr std::size_t joinedAtMost = 96;
constexpr int usualEvery = 5;
constexpr int keptWidth = 640;  // frames are halved, thirded, ... as long as they stay wider

struct EnvMeta {
    const char* name;
    EnvMode mode;
};
constexpr EnvMeta modes[] = {{"auto", EnvMode::Auto},
                             {"panorama", EnvMode::Panorama},
                             {"static", EnvMode::Static},
                             {"pan", EnvMode::Pan},
                             {"loom", EnvMode::Loom}};

/// What is ahead goes `yaw` to the right and `pitch` up, turned by `roll` before.
glm::dmat3 orientation(const EnvJobOptions& options)
{
    return camera::rotationZXY(glm::radians(options.pitch_deg), -glm::radians(options.yaw_deg),
                               -glm::radians(options.roll_deg));
}

bool isTurned(const EnvJobOptions& options)
{
    return options.yaw_deg != 0 || options.pitch_deg != 0 || options.roll_deg != 0;
}

/// "pano.exr" -> "pano_preview.png"; "pano.####.exr" -> "pano_preview.png".
std::string previewName(const EnvJobOptions& options)
{
    if (options.preview == "none") return {};
    if (!options.preview.empty()) return options.preview;
    std::filesystem::path path(options.output);
    std::string stem = path.stem().string();
    if (io::isFramePattern(options.output)) {
        const std::string number = io::framePath(stem, 0);
        std::size_t same = 0;
        while (same < stem.size() && same < number.size() && stem[same] == number[same] && stem[same] != '#') ++same;
        stem = stem.substr(0, same);
        while (!stem.empty() && (stem.back() == '.' || stem.back() == '_' || stem.back() == '-')) stem.pop_back();
        if (stem.empty()) stem = "env";
    }
    return (path.parent_path() / (stem + "_preview.png")).string();
}

void checkOutputs(const EnvJobOptions& options)
{
    io::checkOutputFolder(options.output);
    if (io::imageFormatOf(options.output) != "openexr")
        throw Error(ErrorCode::Output, "'{}': a panorama is written as .exr", options.output);
    const std::string preview = previewName(options);
    const auto refuse = [&](const std::string& path, const char* flag) {
        if (path.empty()) return;
        io::checkOutputFolder(path);
        if (io::isSameFile(path, options.input))
            throw Error(ErrorCode::Output, "{} '{}': is the input itself", flag, path);
        if (path == options.output && std::string(flag) != "--output")
            throw Error(ErrorCode::Output, "{} '{}': is the output itself", flag, path);
    };
    refuse(options.output, "--output");
    refuse(preview, "--preview");
    refuse(options.track, "--track");
    if (!preview.empty() && !preview.ends_with(".png") && !preview.ends_with(".PNG"))
        throw Error(ErrorCode::Output, "--preview '{}': must be a .png", preview);
    if (!options.track.empty() && !options.track.ends_with(".chan"))
        throw Error(ErrorCode::Output, "--track '{}': must be a .chan", options.track);
    for (const std::string& path : {options.output, preview})
        if (!path.empty()) io::sweepLeftovers(path);
}

io::ReadOptions readOptions(const EnvJobOptions& options)
{
    io::ReadOptions read;
    read.colorspace = options.colorspace;
    read.ocio = options.ocio;
    read.onError = io::OnError::Skip;
    return read;
}

json asJson(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

/// Writes the file, and bakes what drops make of it.
class Delivery {
public:
    /// space: of `colors`, that the panoramas are in.
    Delivery(const EnvJobOptions& options, bool isFootage, std::shared_ptr<const io::ColorConfig> colors,
             std::string space)
        : options_(options), isFootage_(isFootage), colors_(std::move(colors)), space_(std::move(space))
    {
    }

    /// number: of a panorama of a sequence.
    void deliver(const Panorama& panorama, const std::string& path, std::optional<FrameNumber> number)
    {
        const auto values = panorama.pixels.values();
        const float brightest = *std::max_element(values.begin(), values.end());
        if (brightest == 0 && isFirst_ && isFootage_)
            log::warning("{}: the footage is black; drops will return no light", options_.input);
        report_["black"] = brightest == 0;
        if (options_.half && brightest > 65504)
            log::warning("{}: half float ends at 65504 and cuts off what is brighter, up to {:.3g}", path, brightest);
        io::writeExr(path, panorama.pixels, {"R", "G", "B"}, options_.half);
        if (number) files_.push_back({{"frame", *number}, {"path", path}});
        if (!isFirst_) return;
        isFirst_ = false;
        const environment::DropRadianceBaker baker;
        const environment::DropRadiance baked = baker.bake(panorama);
        describe(panorama, baked);
        const std::string preview = previewName(options_);
        if (preview.empty()) return;
        io::writePng(preview,
                     environment::previewSheet(panorama, baked, std::filesystem::path(path).filename().string()),
                     *colors_, space_);
        report_["preview"] = preview;
    }

    json report() const
    {
        json result = report_;
        if (!files_.empty()) result["files"] = files_;
        return result;
    }

private:
    void describe(const Panorama& panorama, const environment::DropRadiance& baked)
    {
        const sh::Harmonics harmonics = environment::harmonicsOf(panorama, options_.order);
        json coefficients = json::array();
        for (const glm::dvec3& c : harmonics.coefficient) coefficients.push_back(asJson(c));
        json lights = json::array();
        for (const environment::Light& light : baked.lights) {
            const glm::dvec3& d = light.direction;
            lights.push_back({{"direction", asJson(d)},
                              {"azimuth_deg", glm::degrees(std::atan2(d.x, -d.z))},
                              {"elevation_deg", glm::degrees(std::asin(std::clamp(d.y, -1.0, 1.0)))},
                              {"radius_deg", glm::degrees(light.radius)},
                              {"solid_angle_sr", light.solidAngle},
                              {"radiance", asJson(light.solidAngle > 0 ? light.radiance() : glm::dvec3(0))},
                              {"energy", asJson(light.energy)}});
        }
        report_["output_width"] = panorama.pixels.width();
        report_["output_height"] = panorama.pixels.height();
        report_["mean_radiance"] = asJson(harmonics.coefficient[0] / std::sqrt(4.0 * pi));
        report_["order"] = options_.order;
        report_["coefficients"] = std::move(coefficients);
        report_["auto_order"] = baked.order;
        report_["remainder"] = baked.remainder;
        report_["lights"] = std::move(lights);
    }

    const EnvJobOptions& options_;
    bool isFootage_;
    std::shared_ptr<const io::ColorConfig> colors_;
    std::string space_;
    bool isFirst_ = true;
    json report_ = json::object();
    json files_ = json::array();
};

json repairJson(const environment::PanoramaReport& found, const environment::HighlightReport& highlights)
{
    json repaired = {{"nan", found.nan},
                     {"infinite", found.infinite},
                     {"negative", found.negative},
                     {"transparent", found.transparent},
                     {"clipped", highlights.clipped},
                     {"clipped_share", highlights.share}};
    return repaired;
}

// ---------------------------------------------------------------------------------------------------------------------

/// One picture of all directions.
json fromPanorama(const EnvJobOptions& options, bool isMovie)
{
    ImageF image;
    bool endsAtWhite = true;
    std::string colorspace, colorspaceSource;
    const auto colors = io::ColorConfig::open(options.ocio);
    if (isMovie || io::isFramePattern(options.input)) {
        const auto reader = io::openPlate(options.input, readOptions(options));
        std::vector<FrameNumber> frames =
            options.frames.empty() ? reader->info().frames : parseFrameRange(options.frames);
        endsAtWhite = !reader->info().isFloat;
        if (frames.empty()) throw Error(ErrorCode::Input, "'{}' holds no frame", options.input);
        std::optional<io::PlateFrame> frame = reader->read(frames.front());
        if (!frame) throw Error(ErrorCode::Input, "'{}': frame {} could not be read", options.input, frames.front());
        image = std::move(frame->pixels);
        colorspace = reader->info().colorspace;
        colorspaceSource = reader->info().colorspaceSource;
    } else {
        io::ColorClaim claim;
        image = io::readLinearImage(options.input, options.colorspace, options.ocio, &claim);
        const io::ImageHeader header = io::readImageHeader(options.input);
        endsAtWhite = !header.isFloat;
        colorspace = claim.colorspace;
        colorspaceSource = claim.source;
        if (claim.isGuess() && header.bitDepth > 8 && !header.isFloat)
            log::warning("{}: {} bits and no word of its colour space; taken for {}, --colorspace says otherwise",
                         options.input, header.bitDepth, colorspace);
    }
    const std::optional<environment::PanoramaLayout> layout =
        environment::layoutNamed(options.layout, image.width(), image.height());
    if (!layout)
        throw Error(ErrorCode::InvalidArgument, "--layout '{}': must be {}", options.layout, environment::layoutNames);
    environment::PanoramaReport found;
    Panorama panorama;
    try {
        panorama = environment::preparePanorama(image, options.input, &found, {.layout = *layout});
    } catch (const Error& error) {
        const bool isShape = std::string_view(error.what()).find("is no panorama") != std::string_view::npos;
        if (options.mode != EnvMode::Auto || !isShape) throw;
        throw Error(error.code(), "{}; for a frame of footage say --mode static", error.what());
    }
    for (const std::string& sentence : found.said) log::warning("{}", sentence);
    const environment::HighlightReport highlights = environment::repairHighlights(
        panorama, options.input, {.lightRadiance = options.lightRadiance, .endsAtWhite = endsAtWhite});
    for (const std::string& sentence : highlights.said) log::warning("{}", sentence);
    if (isTurned(options)) panorama = environment::turned(panorama, orientation(options));

    Delivery delivery(options, false, colors, colors->working(colorspace));
    const std::string path = io::isFramePattern(options.output) ? io::framePath(options.output, 0) : options.output;
    delivery.deliver(panorama, path, std::nullopt);
    json report = delivery.report();
    report["mode"] = "panorama";
    report["width"] = found.width;
    report["height"] = found.height;
    report["taken_for"] = found.takenFor;
    report["colorspace"] = colorspace;
    report["colorspace_source"] = colorspaceSource;
    report["working_colorspace"] = colors->working(colorspace);
    report["ocio"] = colors->origin();
    report["repaired"] = repairJson(found, highlights);
    report["light_radiance"] = highlights.lightRadiance ? json(*highlights.lightRadiance) : json();
    report["light_radiance_is_estimate"] = highlights.isEstimate;
    return report;
}

// ---------------------------------------------------------------------------------------------------------------------

/// The plate's pixels averaged over step x step.
ImageF reduced(const ImageF& plate, int step)
{
    if (step <= 1) return plate;
    ImageF small(plate.width() / step, plate.height() / step, plate.channels());
    parallelFor(0, small.height(), 8, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y) {
            for (int x = 0; x < small.width(); ++x) {
                for (int c = 0; c < small.channels(); ++c) {
                    float sum = 0;
                    for (int j = 0; j < step; ++j) {
                        for (int i = 0; i < step; ++i) sum += plate.at(x * step + i, y * step + j, c);
                    }
                    small.at(x, y, c) = sum / float(step * step);
                }
            }
        }
    });
    return small;
}

/// Frames of the footage that were looked at, by number.
class Footage {
public:
    explicit Footage(const EnvJobOptions& options)
        : options_(options), reader_(io::openPlate(options.input, readOptions(options)))
    {
        const io::PlateInfo& info = reader_->info();
        if (info.frames.empty()) throw Error(ErrorCode::Input, "'{}' holds no frame", options.input);
        frames_ = options.frames.empty() ? info.frames : parseFrameRange(options.frames);
        const std::set<FrameNumber> known(info.frames.begin(), info.frames.end());
        std::vector<FrameNumber> missing;
        for (const FrameNumber frame : frames_) {
            if (!known.contains(frame)) missing.push_back(frame);
        }
        if (!missing.empty())
            throw Error(info.isMovie ? ErrorCode::InvalidArgument : ErrorCode::Input,
                        "frames {} are not in '{}', which has {}", formatFrameRange(missing), options.input,
                        formatFrameRange(info.frames));
        std::sort(frames_.begin(), frames_.end());
        step_ = std::max(1, info.width / keptWidth);
    }

    const io::PlateInfo& info() const { return reader_->info(); }
    const std::vector<FrameNumber>& frames() const { return frames_; }

    struct Frame {
        ImageF pixels;
        std::optional<environment::Features> features;
    };

    /// Reads the frames that were not read before; says how many could not be.
    void read(const std::vector<FrameNumber>& numbers, bool withFeatures)
    {
        std::vector<FrameNumber> wanted;
        for (const FrameNumber n : numbers) {
            if (!held_.contains(n) && !damaged_.contains(n)) wanted.push_back(n);
        }
        std::sort(wanted.begin(), wanted.end());
        reader_->schedule(wanted);
        for (const FrameNumber n : wanted) {
            std::optional<io::PlateFrame> frame = reader_->read(n);
            if (!frame) {
                damaged_.insert(n);
                continue;
            }
            ImageF pixels = reduced(frame->pixels, step_);
            if (options_.lightRadiance) {
                const auto report = environment::repairPlateHighlights(pixels, *options_.lightRadiance);
                clipped_ += report.clipped;
            }
            held_[n].pixels = std::move(pixels);
        }
        if (!withFeatures) return;
        std::vector<Frame*> without;
        for (auto& [number, frame] : held_) {
            if (!frame.features) without.push_back(&frame);
        }
        parallelFor(0, std::ptrdiff_t(without.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (std::ptrdiff_t i = first; i < last; ++i)
                without[std::size_t(i)]->features.emplace(without[std::size_t(i)]->pixels);
        });
    }

    std::map<FrameNumber, Frame>& held() { return held_; }
    const std::set<FrameNumber>& damaged() const { return damaged_; }
    std::size_t clipped() const { return clipped_; }

    std::vector<FrameNumber> heldNumbers() const
    {
        std::vector<FrameNumber> numbers;
        for (const auto& [number, frame] : held_) numbers.push_back(number);
        return numbers;
    }

    std::vector<environment::Features> features() const
    {
        std::vector<environment::Features> all;
        for (const auto& [number, frame] : held_) all.push_back(*frame.features);
        return all;
    }

    /// About `count` of the frames, evenly spread, the first and the last among them.
    std::vector<FrameNumber> spread(std::size_t count) const
    {
        std::vector<FrameNumber> some;
        const std::size_t last = frames_.size() - 1;
        count = std::min(count, frames_.size());
        for (std::size_t i = 0; i < count; ++i) some.push_back(frames_[count > 1 ? i * last / (count - 1) : last / 2]);
        return some;
    }

    /// Pairs of frames about a sixth of a second apart, evenly spread: what moves between them is the camera's motion.
    std::vector<FrameNumber> pairs() const
    {
        const std::size_t apart = std::max<std::size_t>(1, std::size_t(std::lround(info().fps / 6)));
        std::set<FrameNumber> some;
        const std::size_t last = frames_.size() - 1;
        for (std::size_t i = 0; i < judged / 2; ++i) {
            const std::size_t at = i * last / (judged / 2 - 1);
            some.insert(frames_[std::min(at, last - std::min(last, apart))]);
            some.insert(frames_[std::min(last, std::min(at, last - std::min(last, apart)) + apart)]);
        }
        return {some.begin(), some.end()};
    }

private:
    const EnvJobOptions& options_;
    std::unique_ptr<io::PlateReader> reader_;
    std::vector<FrameNumber> frames_;
    std::map<FrameNumber, Frame> held_;
    std::set<FrameNumber> damaged_;
    std::size_t clipped_ = 0;
    int step_ = 1;
};

/// What was found of the camera, for the report and the track.
struct Turns {
    double horizontalFov = 0;  // [rad]
    std::map<FrameNumber, glm::dmat3> worldFromCamera;
};

/// Angles of Nuke's ZXY order, R = Ry Rx Rz [deg].
glm::dvec3 chanAngles(const glm::dmat3& r)
{
    const double x = std::asin(std::clamp(-r[2].y, -1.0, 1.0));
    return glm::degrees(glm::dvec3(x, std::atan2(r[2].x, r[2].z), std::atan2(r[0].y, r[1].y)));
}

void writeTrack(const std::string& path, const Turns& turns, double aspect)
{
    std::string text;
    const double verticalFov = glm::degrees(2.0 * std::atan(std::tan(0.5 * turns.horizontalFov) / aspect));
    double before = 0.0;
    for (const auto& [number, rotation] : turns.worldFromCamera) {
        glm::dvec3 angles = chanAngles(rotation);
        // Whoever reads the numbers as curves should not see a turn of 360 degrees.
        angles.y += 360.0 * std::round((before - angles.y) / 360.0);
        before = angles.y;
        text +=
            fmt::format("{} 0 0 0 {:.6f} {:.6f} {:.6f} {:.6f}\n", number, angles.x, angles.y, angles.z, verticalFov);
    }
    io::writeWholeFile(path, text);
}

json turnsJson(const Turns& turns)
{
    json rotations = json::array();
    for (const auto& [number, rotation] : turns.worldFromCamera) {
        const glm::dvec3 angles = chanAngles(rotation);
        const glm::dvec3 ahead = -rotation[2];
        rotations.push_back({{"frame", number},
                             {"rx_deg", angles.x},
                             {"ry_deg", angles.y},
                             {"rz_deg", angles.z},
                             {"azimuth_deg", glm::degrees(std::atan2(ahead.x, -ahead.z))},
                             {"elevation_deg", glm::degrees(std::asin(std::clamp(ahead.y, -1.0, 1.0)))}});
    }
    return rotations;
}

const char* inWords(environment::CameraMotion motion)
{
    switch (motion) {
        case environment::CameraMotion::Unclear: break;
        case environment::CameraMotion::Still: return "still";
        case environment::CameraMotion::Turning: return "turning";
        case environment::CameraMotion::Travelling: return "travelling";
    }
    return "unclear";
}

/// The mode, and one sentence why.
struct Decision {
    EnvMode mode;
    std::string why;
    environment::MotionReport motion;
};

Decision decide(const EnvJobOptions& options, Footage& footage)
{
    if (options.mode != EnvMode::Auto) return {options.mode, "as asked for", {}};
    if (options.every) return {EnvMode::Loom, "--every is given", {}};
    if (footage.frames().size() == 1) return {EnvMode::Static, "there is one frame", {}};
    footage.read(footage.pairs(), true);
    const double fov = glm::radians(options.fov_deg.value_or(usualFov_deg));
    Decision d{EnvMode::Static, {}, environment::judgeMotion(footage.features(), fov)};
    switch (d.motion.motion) {
        case environment::CameraMotion::Still:
            d.why = fmt::format("features move by {:.2g} % of the width", 100 * d.motion.shift);
            break;
        case environment::CameraMotion::Turning:
            d.mode = EnvMode::Pan;
            d.why = fmt::format("the camera turns: rotations explain {:.0f} % of the features that frames share",
                                100 * d.motion.turnedShare);
            break;
        case environment::CameraMotion::Travelling:
            d.mode = EnvMode::Loom;
            d.why = fmt::format(
                "the camera travels: rotations explain no more than {:.0f} % of the features that frames share",
                100 * d.motion.turnedShare);
            break;
        case environment::CameraMotion::Unclear:
            d.why = "the frames show too little to tell how the camera moves";
            log::warning(
                "{}: the frames show too little to tell how the camera moves; taken for a camera that stands still",
                options.input);
            break;
    }
    return d;
}

environment::PlatePanoramaOptions fillOptions(const EnvJobOptions& options)
{
    return {.width = options.width, .skyRadiance = options.sky, .detail = true};
}

/// Frames of one view: a locked camera, or one held by hand, whose trembling is taken out.
Panorama fromStill(const EnvJobOptions& options, Footage& footage, const Decision& decision, Turns& turns)
{
    footage.read(footage.spread(judged), false);
    if (footage.held().empty()) throw Error(ErrorCode::Input, "'{}': none of the frames could be read", options.input);
    turns.horizontalFov = glm::radians(options.fov_deg.value_or(usualFov_deg));
    std::vector<std::optional<glm::dmat3>> rotations(footage.held().size(), glm::dmat3(1.0));
    constexpr double locked = 0.0007;  // of the width: below it is noise
    if (footage.held().size() > 1 && decision.motion.motion == environment::CameraMotion::Still &&
        decision.motion.shift > locked) {
        footage.read({}, true);
        rotations =
            environment::registerTurns(footage.features(), {.horizontalFov = turns.horizontalFov}).worldFromCamera;
    }
    std::vector<environment::PlateView> views;
    std::size_t i = 0;
    std::optional<glm::dmat3> level;
    for (auto& [number, frame] : footage.held()) {
        const std::optional<glm::dmat3>& rotation = rotations[i++];
        if (!rotation) continue;
        if (!level) level = glm::transpose(*rotation);
        // The first frame's axes are the camera's: level unless the flags say otherwise.
        const glm::dmat3 worldFromCamera = orientation(options) * *level * *rotation;
        turns.worldFromCamera[number] = worldFromCamera;
        views.push_back({frame.pixels, turns.horizontalFov, worldFromCamera});
    }
    return environment::panoramaFromViews(views, fillOptions(options));
}

/// Frames of a camera that turns, joined.
Panorama fromPan(const EnvJobOptions& options, Footage& footage, Turns& turns, json& report)
{
    const auto advice = [] { return "give the field of view with --fov, or take one view with --mode static"; };
    footage.read(footage.spread(joinedAtFirst), true);
    if (footage.held().size() < 2)
        throw Error(ErrorCode::Input, "'{}': {} frame could be read, which is not enough to join; {}", options.input,
                    footage.held().size(), advice());
    environment::RegistrationOptions wanted;
    if (options.fov_deg) wanted.horizontalFov = glm::radians(*options.fov_deg);
    wanted.usualFov = glm::radians(usualFov_deg);
    environment::Registration found;
    for (;;) {
        log::detail("joining {} frames", footage.held().size());
        found = environment::registerTurns(footage.features(), wanted);
        if (found.gaps.empty() || footage.held().size() >= joinedAtMost) break;
        // Frames between those that do not join.
        const std::vector<FrameNumber> numbers = footage.heldNumbers();
        const std::vector<FrameNumber>& all = footage.frames();
        std::vector<FrameNumber> between;
        for (const auto& [a, b] : found.gaps) {
            const auto from = std::upper_bound(all.begin(), all.end(), numbers[a]);
            const auto to = std::lower_bound(all.begin(), all.end(), numbers[b]);
            if (from < to) between.push_back(*(from + (to - from) / 2));
        }
        const std::size_t before = footage.held().size();
        if (between.size() + before > joinedAtMost) between.resize(joinedAtMost - before);
        footage.read(between, true);
        if (footage.held().size() == before) break;
    }
    const std::size_t count = footage.held().size();
    if (found.joined < 2 || std::size_t(found.joined) * 2 < count)
        throw Error(ErrorCode::Input, "'{}': only {} of {} frames could be joined to a panorama; {}", options.input,
                    found.joined, count, advice());
    if (std::size_t(found.joined) < count)
        log::warning("{}: {} of {} frames show nothing in common with the others and are left out", options.input,
                     count - std::size_t(found.joined), count);
    if (!wanted.horizontalFov && !found.fovIsEstimated)
        log::warning(
            "{}: the camera turns too little to tell its field of view; {:g} degrees are assumed, --fov sets it",
            options.input, usualFov_deg);

    turns.horizontalFov = found.horizontalFov;
    std::vector<environment::PlateView> views;
    std::size_t i = 0;
    for (auto& [number, frame] : footage.held()) {
        const std::optional<glm::dmat3>& rotation = found.worldFromCamera[i++];
        if (!rotation) continue;
        turns.worldFromCamera[number] = orientation(options) * *rotation;
        views.push_back({frame.pixels, turns.horizontalFov, turns.worldFromCamera[number]});
    }
    report["fov_is_estimate"] = found.fovIsEstimated;
    report["fov_relative_deviation"] = found.fovDeviation;
    report["residual_px"] =
        found.residual_px * double(footage.info().width) / footage.held().begin()->second.pixels.width();
    report["matches"] = found.matches;
    report["closes"] = found.closes;
    environment::PlatePanoramaOptions fill = fillOptions(options);
    fill.evenExposures = true;
    return environment::panoramaFromViews(views, fill);
}

json fromFootage(const EnvJobOptions& options, const std::function<Verdict(const Progress&)>& progress)
{
    Footage footage(options);
    const io::PlateInfo& info = footage.info();
    Decision decision = decide(options, footage);
    const bool isPattern = io::isFramePattern(options.output);
    if (decision.mode == EnvMode::Loom && !isPattern && footage.frames().size() > 1) {
        if (options.mode == EnvMode::Loom || options.every)
            throw Error(ErrorCode::Output,
                        "'{}': is one image, but there is a panorama every {} frames; name a pattern such as "
                        "pano.####.exr",
                        options.output, options.every.value_or(usualEvery));
        log::warning("{}: {}; the panorama is of the frame in the middle, -o pano.####.exr writes one every {} frames",
                     options.input, decision.why, usualEvery);
    } else if (options.mode == EnvMode::Auto &&
               (decision.motion.motion != environment::CameraMotion::Unclear || decision.motion.frames == 0)) {
        log::info("'{}': mode {}, {}", options.input, nameOf(decision.mode), decision.why);
    }

    Delivery delivery(options, true, info.colors, info.workingColorspace);
    Turns turns;
    json report = json::object();
    std::vector<FrameNumber> used;
    bool stopped = false;
    if (decision.mode == EnvMode::Loom) {
        turns.horizontalFov = glm::radians(options.fov_deg.value_or(usualFov_deg));
        std::vector<FrameNumber> keys;
        const std::size_t every = std::size_t(options.every.value_or(usualEvery));
        for (std::size_t i = 0; i < footage.frames().size(); i += every) keys.push_back(footage.frames()[i]);
        if (!isPattern) keys = {footage.frames()[footage.frames().size() / 2]};
        footage.held().clear();
        const Timer clock;
        Progress state;
        state.total = keys.size();
        for (const FrameNumber key : keys) {
            footage.read({key}, false);
            const auto found = footage.held().find(key);
            if (found != footage.held().end()) {
                const environment::PlateView view{found->second.pixels, turns.horizontalFov, orientation(options)};
                delivery.deliver(environment::panoramaFromViews({&view, 1}, fillOptions(options)),
                                 isPattern ? io::framePath(options.output, key) : options.output, key);
                used.push_back(key);
                footage.held().clear();
            }
            ++state.done;
            state.frame = key;
            state.seconds = clock.seconds();
            if (progress(state) == Verdict::Stop) {
                stopped = true;
                break;
            }
        }
        if (used.empty()) throw Error(ErrorCode::Input, "'{}': none of the frames could be read", options.input);
    } else {
        const Panorama panorama = decision.mode == EnvMode::Pan ? fromPan(options, footage, turns, report)
                                                                : fromStill(options, footage, decision, turns);
        for (const auto& [number, rotation] : turns.worldFromCamera) used.push_back(number);
        delivery.deliver(panorama, isPattern ? io::framePath(options.output, used.front()) : options.output,
                         std::nullopt);
        report["rotations"] = turnsJson(turns);
        if (!options.track.empty()) writeTrack(options.track, turns, double(info.width) / info.height);
    }
    if (!footage.damaged().empty())
        log::warning("{}: frames {} are damaged and were left out", options.input,
                     formatFrameRange({footage.damaged().begin(), footage.damaged().end()}));

    report.update(delivery.report());
    report["mode"] = nameOf(decision.mode);
    report["colorspace"] = info.colorspace;
    report["colorspace_source"] = info.colorspaceSource;
    report["working_colorspace"] = info.workingColorspace;
    report["ocio"] = info.colors->origin();
    report["mode_reason"] = decision.why;
    report["motion"] = {{"kind", inWords(decision.motion.motion)},
                        {"shift", decision.motion.shift},
                        {"turned_share", decision.motion.turnedShare},
                        {"expansion", decision.motion.expansion}};
    report["width"] = info.width;
    report["height"] = info.height;
    report["taken_for"] = decision.mode == EnvMode::Static ? "footage of a camera that stands still"
                          : decision.mode == EnvMode::Pan  ? "footage of a camera that turns"
                                                           : "footage of a camera that travels";
    report["frames"] = used.size();
    report["frame_range"] = formatFrameRange(used);
    report["fov_deg"] = glm::degrees(turns.horizontalFov);
    report["focal_px"] = 0.5 * info.width / std::tan(0.5 * turns.horizontalFov);
    if (!report.contains("fov_is_estimate")) report["fov_is_estimate"] = false;
    report["fov_source"] = options.fov_deg                         ? "--fov"
                           : report["fov_is_estimate"].get<bool>() ? "estimated from the frames"
                                                                   : "assumed";
    report["repaired"] = {{"clipped", footage.clipped()}, {"frames", footage.damaged()}};
    report["light_radiance"] = options.lightRadiance ? json(*options.lightRadiance) : json();
    report["light_radiance_is_estimate"] = false;
    report["stopped"] = stopped;
    return report;
}

}  // namespace

std::optional<EnvMode> envModeNamed(const std::string& name)
{
    for (const EnvMeta& meta : modes) {
        if (name == meta.name) return meta.mode;
    }
    return std::nullopt;
}

const char* nameOf(EnvMode mode)
{
    for (const EnvMeta& meta : modes) {
        if (mode == meta.mode) return meta.name;
    }
    return "auto";
}

json runEnvJob(const EnvJobOptions& options, const std::function<Verdict(const Progress&)>& progress)
{
    const Timer clock;
    io::refuseTwoPatterns(options.output, ErrorCode::Output);
    checkOutputs(options);
    const bool isStill = io::isImageName(options.input) && !io::isFramePattern(options.input);
    const bool isPanorama = options.mode == EnvMode::Panorama || (options.mode == EnvMode::Auto && isStill);
    if (isPanorama) {
        const auto forFootage = [&](const char* flag, const std::string& value) {
            throw Error(ErrorCode::InvalidArgument, "{} '{}': is for footage, and '{}' is one picture", flag, value,
                        options.input);
        };
        if (options.every) forFootage("--every", fmt::format("{}", *options.every));
        if (!options.track.empty()) forFootage("--track", options.track);
        if (options.fov_deg) forFootage("--fov", fmt::format("{:g}", *options.fov_deg));
        if (options.sky) forFootage("--sky", fmt::format("{:g}", *options.sky));
        if (isStill && !options.frames.empty()) forFootage("--frames", options.frames);
    }
    json report = isPanorama ? fromPanorama(options, !io::isImageName(options.input)) : fromFootage(options, progress);
    report["input"] = options.input;
    report["output"] = options.output;
    report["seconds"] = clock.seconds();
    return report;
}

}  // namespace virga::shot
