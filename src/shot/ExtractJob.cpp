#include "shot/ExtractJob.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/Error.h"
#include "core/Log.h"
#include "core/Parallel.h"
#include "core/Timer.h"
#include "matte/ExposureGain.h"
#include "matte/FrameAlignment.h"
#include "matte/RainExtraction.h"
#include "shot/EnvironmentColor.h"
#include "shot/ExtractDelivery.h"
#include "shot/ExtractFootage.h"
#include "shot/ExtractSurvey.h"
#include "shot/ModelSpace.h"

namespace virga::shot {
namespace {

using nlohmann::json;

constexpr double degree = std::numbers::pi / 180.0;
constexpr double mostUntrusted = 0.35;        // of all samples: beyond it no scene stands still
constexpr double mostUntrustedIfLost = 0.05;  // the same where three frames could not be registered either
constexpr double fewestInliers = 0.5, mostResidual_px = 0.5;
constexpr double mostOfRange = 0.8;
constexpr double mostNoise = 0.1;                    // of what is bright: twice as much as the noisiest footage has
constexpr float addedColor = 1.5f, mostReal = 3.0f;  // of the brightest of the footage

matte::ExtractionOptions matteOptions(const ExtractJobOptions& job)
{
    matte::ExtractionOptions options;
    options.paper = job.paper;
    options.lambda = job.lambda;
    options.mu = job.mu;
    options.rounds = job.iterations.value_or(job.paper ? 20 : options.rounds);
    options.tolerance = job.tolerance;
    options.movers = job.movers;
    if (job.slant_deg) options.slant = *job.slant_deg * degree;
    return options;
}

/// A folder that is taken away again if nothing comes of it.
class OutputFolder {
public:
    explicit OutputFolder(const std::string& path) : path_(path)
    {
        std::error_code error;
        if (std::filesystem::is_directory(path_, error)) return;
        if (std::filesystem::exists(path_, error))
            throw Error(ErrorCode::Output, "'{}': is a file, not a folder", path);
        if (!std::filesystem::create_directory(path_, error))
            throw Error(ErrorCode::Output, "'{}': the folder cannot be made: {}", path,
                        error ? error.message() : "there is no folder to make it in");
        isOurs_ = true;
    }
    ~OutputFolder()
    {
        std::error_code error;
        if (isOurs_ && std::filesystem::is_empty(path_, error)) std::filesystem::remove(path_, error);
    }
    OutputFolder(const OutputFolder&) = delete;
    OutputFolder& operator=(const OutputFolder&) = delete;

private:
    std::filesystem::path path_;
    bool isOurs_ = false;
};

/// What a frame does not show is taken from the reference, so that it has an exposure and a median; it is not trusted.
void fillUncovered(ImageF& frame, const ImageF& covered, const ImageF& reference)
{
    const auto channels = std::size_t(frame.channels());
    for (std::size_t i = 0; i < covered.size(); ++i)
        if (covered.data()[i] < 0.5f)
            std::copy_n(reference.data() + i * channels, channels, frame.data() + i * channels);
}

double untrustedShare(const matte::Extraction& found)
{
    double sum = 0, count = 0;
    for (const ImageF& trust : found.trust)
        for (const float value : trust.values()) {
            sum += value < 0.5f;
            ++count;
        }
    return count > 0 ? sum / count : 0;
}

/// Linear-light colour -> as the model has it.
std::array<float, 3> toModelColor(const std::array<double, 3>& color, ModelSpace space)
{
    ImageF one(1, 1, 3);
    for (std::size_t j = 0; j < 3; ++j) one.data()[j] = float(color[j]);
    toModel(one, space);
    return {one.data()[0], one.data()[1], one.data()[2]};
}

/// The C that mattes are made for. Light that was added has none, and one far beyond white would make them next to
/// nothing: half as bright again as the brightest of the footage serves.
std::array<float, 3> shownColor(const matte::Extraction& found)
{
    std::array<float, 3> color = found.color;
    const auto values = found.scene.values();
    const float white = *std::max_element(values.begin(), values.end());
    const float brightest = *std::max_element(color.begin(), color.end());
    const bool isFound = found.colorSource == matte::ColorSource::Given || brightest < mostReal * white;
    if (isFound && found.colorSource != matte::ColorSource::Added) return color;
    for (float& value : color) value *= std::min(1.0f, addedColor * white / brightest);
    return color;
}

/// So many frames that what is held of them, three times their size as float RGB, takes no more than half of the
/// machine's memory.
int framesThatFit(const io::PlateInfo& info)
{
    const double memory = double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGESIZE));
    const double frame = 3.0 * 12.0 * info.width * info.height;
    // One span may have half as many again.
    return int(std::clamp(0.5 * memory / (1.5 * frame), 4.0, 1e6));
}

class ExtractRun {
public:
    ExtractRun(const ExtractJobOptions& job, const std::function<Verdict(const Progress&)>& progress)
        : job_(job), progress_(progress), footage_(job), delivery_(job, footage_)
    {
        options_ = matteOptions(job);
        window_ = std::min(job.window, framesThatFit(footage_.info()));
        const auto count = int(footage_.frames().size());
        if (std::min(count, job.window) > window_)
            log::warning("'{}': {} frames are solved together, as many as this machine's memory holds", job.footage,
                         window_);
    }

    json run()
    {
        survey();
        solveAll();
        return report();
    }

private:
    using Window = FootageWindow;

    std::vector<FrameNumber> numbers(std::size_t first, std::size_t count) const
    {
        const auto begin = footage_.frames().begin() + std::ptrdiff_t(first);
        return {begin, begin + std::ptrdiff_t(count)};
    }

    /// The frames that the whole clip is judged by: all of a short one, else as many as a window has, evenly spread, or
    /// neighbours where the camera moves.
    std::vector<FrameNumber> surveyed() const
    {
        const std::size_t all = footage_.frames().size();
        if (spans_.size() == 1) return footage_.frames();
        const auto count = std::min(all, std::size_t(window_));
        if (job_.stabilize) return numbers((all - count) / 2, count);
        std::vector<FrameNumber> some;
        for (std::size_t i = 0; i < count; ++i)
            some.push_back(footage_.frames()[count > 1 ? i * (all - 1) / (count - 1) : 0]);
        return some;
    }

    void survey()
    {
        spans_ = windowSpans(footage_.frames().size(), std::size_t(window_));
        Window window = footage_.readLinear(surveyed());
        if (window.size() == 0)
            throw Error(ErrorCode::Input, "'{}': none of the frames {} could be read", job_.footage,
                        formatFrameRange(footage_.frames()));
        if (footage_.damagedShare() >= 1.0)
            throw Error(ErrorCode::Input, "'{}': no pixel is a finite number", job_.footage);
        const Timer timer;
        together(
            [&] {
                if (!job_.stabilize) camera_ = judgeCamera(window.frames);
            },
            [&] { space_ = chooseSpace(job_, footage_.info().isFloat, window.frames); });
        if (camera_.moves)
            stopOrGoOn(fmt::format("the camera moves, by {:.1f} px at the corners; --stabilize registers the frames",
                                   camera_.motion_px));
        footage_.judgeChannels(window);
        footage_.toModel(window, space_.space);
        if (job_.color) options_.color = toModelColor(*job_.color, space_.space);
        const double preparing = timer.seconds();
        seconds_["prepare"] += preparing;

        Solved solved = solve(window, {}, true);
        judgeStillness(solved);
        const bool isFallback = solved.found.colorSource == matte::ColorSource::Fallback && !job_.color;
        if (isFallback && !job_.paper) {
            fallBack(solved.found);
            solved = solve(window, {}, true);
        }
        colorSource_ = !isFallback || job_.paper ? nameOf(solved.found.colorSource) : fallbackName_;
        colorError_ = solved.found.colorError;
        delivery_.setModel({space_.space, solved.found.color, shownColor(solved.found)});
        {
            const Timer judging;
            delivery_.judge(job_.stabilize ? solved.registered : window.frames, solved.found,
                            spans_.size() == 1 && !job_.stabilize);
            solved.registered.clear();
            seconds_["strokes"] += judging.seconds();
        }
        delivery_.keepPlate(solved.found);
        describe(solved);
        if (spans_.size() == 1) {
            delivered_ = std::move(window);
            only_ = std::move(solved);
            return;
        }
        options_.color = solved.found.color;
        if (!job_.slant_deg) options_.slant = solved.found.direction.slant;
    }

    /// A window's solution. Where the camera moves it is that of the middle frame's view.
    struct Solved : ExtractDelivery::Solution {
        std::vector<ImageF> registered;  // the frames in that view, of a survey whose camera moves
    };

    Solved solve(Window& window, const ImageF& start, bool isSurvey = false)
    {
        const Timer timer;
        Solved solved;
        if (!job_.stabilize) {
            restore(window);
            solved.found = matte::extractRain(window.frames, options_, start, window.finite);
            gains_ = solved.found.gains;
        } else {
            const int middle = int(window.size() / 2);
            solved.places = matte::alignFrames(window.frames, middle);
            std::vector<ImageF> frames(window.size()), covered(window.size());
            for (std::size_t k = 0; k < window.size(); ++k) {
                const matte::FrameAlignment& place = solved.places[k];
                frames[k] = matte::warpToReference(window.frames[k], place.referenceFromFrame, &covered[k]);
                if (!place.found)
                    if (!place.found)
                        for (float& value : covered[k].values()) value = 0.0f;
                fillUncovered(frames[k], covered[k], window.frames[std::size_t(middle)]);
                if (window.finite.empty()) continue;
                const ImageF finite = matte::warpToReference(window.finite[k], place.referenceFromFrame);
                for (std::size_t i = 0; i < finite.size(); ++i)
                    covered[k].data()[i] *= finite.data()[i] > 0.99f ? 1.0f : 0.0f;
            }
            solved.found = matte::extractRain(frames, options_, {}, covered);
            if (isSurvey) solved.registered = std::move(frames);
        }
        if (solved.found.rose) log::warning("the objective rose; the alternation was stopped there");
        seconds_["solve"] += timer.seconds();
        return solved;
    }

    /// Where it does not rain there is nothing to solve.
    Solved nothing(const Window& window) const
    {
        Solved solved;
        solved.found.scene = delivery_.plateInModel();
        solved.found.alphas.assign(window.size(), ImageF(footage_.info().width, footage_.info().height, 1));
        solved.found.gains.assign(window.size() * std::size_t(footage_.channels()), 1.0);
        return solved;
    }

    /// Gives the frames back the exposure that an earlier solve took out.
    void restore(Window& window)
    {
        const auto channels = std::size_t(footage_.channels());
        for (std::size_t k = 0; k < window.size() && gains_.size() == window.size() * channels; ++k)
            matte::applyGain(window.frames[k], std::span(gains_).subspan(k * channels, channels));
        gains_.clear();
    }

    void stopOrGoOn(const std::string& problem) const
    {
        const std::string sentence =
            fmt::format("'{}': no scene stands still behind the rain: {}", job_.footage, problem);
        if (!job_.force) throw Error(ErrorCode::Input, "{} (--force goes on)", sentence);
        log::warning("{}", sentence);
    }

    void judgeStillness(const Solved& solved)
    {
        untrusted_ = std::max(0.0, untrustedShare(solved.found) - footage_.damagedShare());
        double residual = 0, inliers = 1;
        std::size_t lost = 0;
        for (const matte::FrameAlignment& place : solved.places) {
            residual = std::max(residual, place.residual_px);
            inliers = std::min(inliers, place.inlierShare);
            motion_px_ = std::max(motion_px_, place.motion_px);
            lost += !place.found;
        }
        residual_px_ = residual;
        inlierShare_ = inliers;
        std::string problem;
        if (lost > 0)
            problem = fmt::format("{} of {} frames cannot be registered", lost, solved.places.size());
        else if (!solved.places.empty() && (inliers < fewestInliers || residual > mostResidual_px))
            problem = fmt::format("after registration {:.0f} % of the picture is in place, to {:.2f} px", 100 * inliers,
                                  residual);
        else if (untrusted_ > mostUntrusted || (camera_.isLost && untrusted_ > mostUntrustedIfLost))
            problem = fmt::format("{:.0f} % of the samples are of things that move{}", 100 * untrusted_,
                                  job_.stabilize ? "" : "; for a camera that shakes or pans there is --stabilize");
        else if (solved.found.noise.typical > mostNoise * solved.found.range)
            problem = fmt::format("its frames differ everywhere, by {:.0f} % of what is bright in it",
                                  100 * solved.found.noise.typical / solved.found.range);
        if (!problem.empty()) stopOrGoOn(problem);
    }

    /// C where the strokes do not tell: what a drop returns of the light around the plate, if that is brighter than
    /// the ground that rain is seen over and than most of the scene, as it has to be; else half as bright again as the
    /// brightest.
    void fallBack(const matte::Extraction& found)
    {
        ImageF plate = found.scene;
        fromModel(plate, space_.space);
        const std::array<float, 3> color = toModelColor(environmentColor(plate, job_.fov_deg * degree), space_.space);
        const double mean = (double(color[0]) + color[1] + color[2]) / 3;
        const auto assumed = float(addedColor * found.range);
        const bool isBright = mean > std::max(found.brightestWet, mostOfRange * found.range);
        options_.fallbackColor = isBright ? color : std::array{assumed, assumed, assumed};
        fallbackName_ = isBright ? "environment" : "assumed";
    }

    void solveAll()
    {
        const Timer clock;
        Progress state;
        state.total = footage_.frames().size();
        const auto tell = [&](FrameNumber number) {
            ++state.done;
            state.frame = number;
            state.seconds = clock.seconds();
            return progress_(state) == Verdict::Continue;
        };
        if (spans_.size() == 1) {
            deliver(delivered_, only_, 0, delivered_.size(), nullptr, 0, tell);
            delivery_.finish();
            return;
        }
        gains_.clear();  // those of the survey's frames
        Window window;
        std::size_t held = 0;  // so many frames have been read; some may have been left out
        ImageF scene = delivery_.plateInModel();
        std::optional<Solved> before;
        for (const WindowSpan& span : spans_) {
            window.dropBefore(footage_.frames()[span.first]);
            Window more = footage_.readLinear(numbers(held, span.first + span.count - held));
            held = span.first + span.count;
            footage_.toModel(more, space_.space);
            window.add(std::move(more));
            if (window.size() == 0) continue;
            Solved solved = delivery_.rains() ? solve(window, scene) : nothing(window);
            const FrameNumber from = footage_.frames()[span.from], last = footage_.frames()[span.to - 1];
            std::size_t k0 = 0, k1 = window.size();
            while (k0 < k1 && window.numbers[k0] < from) ++k0;
            while (k1 > k0 && window.numbers[k1 - 1] > last) --k1;
            if (!deliver(window, solved, k0, k1, before ? &*before : nullptr, span.fade, tell)) break;
            if (!job_.stabilize) scene = solved.found.scene;
            restore(window);
            before = std::move(solved);
        }
        delivery_.finish();
    }

    template <class Tell>
    bool deliver(const Window& window, Solved& solved, std::size_t from, std::size_t to, const Solved* before,
                 std::size_t fade, const Tell& tell)
    {
        solved.numbers = window.numbers;
        stopped_ = !delivery_.deliver(window, solved, from, to, before, fade, tell);
        return !stopped_;
    }

    void describe(const Solved& solved)
    {
        const matte::Extraction& e = solved.found;
        const auto [least, most] = std::minmax_element(e.gains.begin(), e.gains.end());
        json objective = json::array();
        for (const matte::RainObjective& f : e.history) objective.push_back(f.total());
        model_ = {{"space", nameOf(space_.space)},
                  {"space_chosen", space_.why},
                  {"noise_unevenness",
                   {{"linear", space_.linear ? json(*space_.linear) : json()},
                    {"display", space_.display ? json(*space_.display) : json()}}},
                  {"paper", job_.paper},
                  {"channels", footage_.channels()},
                  {"lambda", e.terms.lambda},
                  {"mu", e.terms.mu},
                  {"noise", e.noise.typical},
                  {"noise_255", 255 * e.noise.typical},
                  {"exposure_gains", {{"least", *least}, {"most", *most}}},
                  {"moving_share", untrusted_},
                  {"camera_motion_px", camera_.motion_px},
                  {"objective", std::move(objective)},
                  {"objective_rose", e.rose},
                  {"window", window_},
                  {"windows", spans_.size()}};
        rain_ = {{"color_model", {e.color[0], e.color[1], e.color[2]}},
                 {"color_error", colorError_},
                 {"color_source", colorSource_},
                 {"slant_deg", e.direction.slant / degree},
                 {"coherence", e.direction.coherence}};
        if (job_.stabilize)
            stabilized_ = {{"residual_px", residual_px_}, {"inlier_share", inlierShare_}, {"motion_px", motion_px_}};
    }

    json report()
    {
        seconds_["read"] = footage_.seconds();
        json report = delivery_.report();
        json rain = rain_;
        rain.update(report["rain"]);
        report["rain"] = std::move(rain);
        report["model"] = model_;
        report["stabilized"] = stabilized_;
        for (const auto& [name, value] : seconds_) {
            const double before = report["seconds"].value(name, 0.0);
            report["seconds"][name] = before + value;
        }
        report["seconds"]["total"] = clock_.seconds();
        report["stopped"] = stopped_;
        delivery_.writeReport(report);
        return report;
    }

    static const char* nameOf(matte::ColorSource source)
    {
        switch (source) {
            case matte::ColorSource::Given: return "given";
            case matte::ColorSource::Strokes: return "strokes";
            case matte::ColorSource::Added: return "added light";
            case matte::ColorSource::Fallback: return "assumed";
        }
        return "";
    }
    static const char* nameOf(ModelSpace space) { return shot::nameOf(space); }

    const Timer clock_;
    const ExtractJobOptions& job_;
    const std::function<Verdict(const Progress&)>& progress_;
    ExtractFootage footage_;
    ExtractDelivery delivery_;
    matte::ExtractionOptions options_;
    int window_ = 0;  // frames that are solved together
    std::vector<WindowSpan> spans_;
    SpaceChoice space_;
    Window delivered_;  // of a clip of one span, whose survey is all there is to solve
    Solved only_;
    std::vector<double> gains_;
    std::string colorSource_;
    const char* fallbackName_ = "assumed";
    double colorError_ = 0, untrusted_ = 0, residual_px_ = 0, inlierShare_ = 1, motion_px_ = 0;
    CameraJudgement camera_;
    bool stopped_ = false;
    json model_, rain_, stabilized_;
    std::map<std::string, double> seconds_;
};

}  // namespace

json runExtractJob(const ExtractJobOptions& options, const std::function<Verdict(const Progress&)>& progress)
{
    const OutputFolder folder(options.output);
    return ExtractRun(options, progress).run();
}

}  // namespace virga::shot
