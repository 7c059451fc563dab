#include "shot/Preflight.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <glm/trigonometric.hpp>
#include <iterator>
#include <nlohmann/json.hpp>

#include "core/Error.h"
#include "core/Parallel.h"
#include "io/ImageFile.h"
#include "io/Writers.h"
#include "shot/AtlasFile.h"
#include "shot/CameraTrack.h"
#include "shot/DepthSource.h"
#include "shot/FrameChoice.h"
#include "shot/JobInputs.h"
#include "shot/LightsFile.h"

namespace virga::shot {

namespace fs = std::filesystem;

namespace {

const char* wordOf(Severity severity)
{
    switch (severity) {
        case Severity::Ok: return "ok";
        case Severity::Note: return "note";
        case Severity::Warning: return "warning";
        case Severity::Error: return "error";
    }
    return "";
}

/// "512 MB", "3.4 GB".
std::string amount(std::uint64_t bytes)
{
    const double mb = double(bytes) / (1 << 20);
    return mb < 1024 ? fmt::format("{:.0f} MB", mb) : fmt::format("{:.1f} GB", mb / 1024);
}

class Check {
public:
    Check(const Settings& settings, const RainJobOptions& options) : s_(settings), job_(options) {}

    std::vector<Finding> run()
    {
        plan_ = planFrame(s_, {.layers = job_.layers}, false);
        guarded("plate", [&] { checkPlate(); });
        if (reader_) findPlateCamera();
        if (!s_.depth.empty() || !s_.ground.empty()) guarded("depth", [&] { checkDepth(); });
        guarded("camera", [&] { checkCamera(); });
        checkLight();
        if (reader_) guarded("output", [&] { checkOutput(); });
        return std::move(found_);
    }

private:
    void add(Severity severity, const char* input, std::string sentence, std::string flag = "")
    {
        found_.push_back({severity, input, std::move(sentence), std::move(flag)});
    }
    void addAll(const std::vector<Finding>& some) { found_.insert(found_.end(), some.begin(), some.end()); }

    template <class Body>
    void guarded(const char* input, Body&& body)
    {
        try {
            body();
        } catch (const Error& error) {
            add(Severity::Error, input, error.what());
        }
    }

    const io::PlateInfo& plate() const { return reader_->info(); }
    bool goesOn() const { return onErrorOf(s_) != io::OnError::Stop; }

    void checkPlate()
    {
        reader_ = io::openPlate(job_.plate, readOptionsOf(s_, onErrorOf(s_)));
        const io::PlateInfo& info = plate();
        frames_ = info.frames;
        add(Severity::Ok, "plate",
            fmt::format("'{}' is {}, {}x{}, frames {}, {:g} frames a second", info.path, info.format, info.width,
                        info.height, formatFrameRange(info.frames), info.fps));
        addAll(plateDoubts(info, info.isMovie || s_.fps || io::readImageHeader(pathOf(info.path, frames_[0])).fps > 0));
        guarded("plate", [&] {
            frames_ = chooseFrames(job_.frames, info, onErrorOf(s_));
            std::vector<FrameNumber> missing;
            for (const FrameNumber frame : frames_)
                if (!info.isStill && !std::binary_search(info.frames.begin(), info.frames.end(), frame))
                    missing.push_back(frame);
            if (!missing.empty())
                add(Severity::Warning, "plate",
                    fmt::format("{} missing, which --on-error {} goes over", describeFrames(missing, "is", "are"),
                                s_.onError));
        });
        if (!info.isMovie && !info.isStill) checkSequence("plate", info.path, info.frames, info.width, info.height);
        checkMemory();
    }

    static std::string pathOf(const std::string& pattern, FrameNumber frame)
    {
        return io::isFramePattern(pattern) ? io::framePath(pattern, frame) : pattern;
    }

    /// Headers of a sequence's files: all of them, or of a very long one as many, evenly spread.
    void checkSequence(const char* input, const std::string& pattern, const std::vector<FrameNumber>& all, int width,
                       int height)
    {
        constexpr std::size_t most = 2000;
        std::vector<FrameNumber> wanted = frames_, frames;
        std::sort(wanted.begin(), wanted.end());
        std::set_intersection(all.begin(), all.end(), wanted.begin(), wanted.end(), std::back_inserter(frames));
        if (frames.size() > most) {
            for (std::size_t i = 0; i < most; ++i) frames[i] = frames[i * frames.size() / most];
            frames.resize(most);
        }
        const bool isPlate = pattern == plate().path;
        std::vector<std::string> faults(frames.size());
        parallelFor(0, std::ptrdiff_t(frames.size()), 8, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (auto i = std::size_t(first); i < std::size_t(last); ++i) {
                try {
                    const io::ImageHeader header =
                        isPlate ? io::readPictureHeader(io::framePath(pattern, frames[i]), {s_.layer, s_.view})
                                : io::readImageHeader(io::framePath(pattern, frames[i]));
                    if (header.width != width || header.height != height)
                        faults[i] =
                            fmt::format("{}: is {}x{}, but the first frame of the sequence is {}x{}",
                                        io::framePath(pattern, frames[i]), header.width, header.height, width, height);
                } catch (const Error& error) {
                    faults[i] = error.what();
                }
            }
        });
        constexpr std::size_t named = 5;
        std::size_t count = 0;
        for (const std::string& fault : faults)
            if (!fault.empty() && ++count <= named)
                add(goesOn() ? Severity::Warning : Severity::Error, input, fault, goesOn() ? "" : "--on-error");
        if (count > named)
            add(goesOn() ? Severity::Warning : Severity::Error, input,
                fmt::format("{} more of its files are like that", count - named));
    }

    void checkMemory()
    {
        const io::PlateInfo& info = plate();
        // Frames of RGBA floats at once: read ahead, rendered from and into, waiting to be written; and the layers'.
        constexpr std::uint64_t frames = 16, layerFrames = 20, bytes = 16;
        const std::uint64_t needed =
            std::uint64_t(info.width) * std::uint64_t(info.height) * bytes * (frames + (job_.layers ? layerFrames : 0));
        std::ifstream file("/proc/meminfo");
        for (std::string word; file >> word;)
            if (std::uint64_t kilobytes = 0; word == "MemAvailable:" && file >> kilobytes) {
                found_.push_back(memoryFinding(needed, kilobytes << 10));
                return;
            }
    }

    void checkDepth()
    {
        if (s_.depth.empty()) {
            const Ground ground = parseGround(s_.ground);
            add(Severity::Ok, "depth",
                fmt::format("a ground plane {:g} m under the camera, which looks {:g} deg down", ground.height_m,
                            ground.pitch_deg));
            return;
        }
        if (!s_.ground.empty())
            add(Severity::Note, "depth", "--depth and --ground are both given; depth comes from the images");
        if (!plan_.features.depth) add(Severity::Note, "depth", "nothing that is rendered looks at it");
        depth::DepthOptions options = depthOptionsOf(s_);
        DepthReader depth(s_);
        if (!reader_) return;
        FrameNumber sample = frames_.front();
        if (!depth.isOne()) {
            const std::vector<FrameNumber> there = depth.frames();
            std::vector<FrameNumber> missing;
            for (const FrameNumber frame : frames_)
                if (!std::binary_search(there.begin(), there.end(), frame)) missing.push_back(frame);
            const std::string has = fmt::format("'{}' has frames {}", s_.depth, formatFrameRange(there));
            if (missing.empty())
                add(Severity::Ok, "depth", has);
            else
                add(goesOn() ? Severity::Warning : Severity::Error, "depth",
                    fmt::format("{}; {} missing", has, describeFrames(missing, "is", "are")),
                    missing.size() == frames_.size() && !io::isFramePattern(s_.depth)
                        ? fmt::format("--depth-first-frame {}", *std::min_element(frames_.begin(), frames_.end()))
                    : goesOn() ? ""
                               : "--on-error");
            const auto usable = std::find_if(frames_.begin(), frames_.end(), [&](FrameNumber frame) {
                return std::binary_search(there.begin(), there.end(), frame);
            });
            sample = usable != frames_.end() ? *usable : there.front();
        } else if (frames_.size() > 1 && (hasCameraFile(s_) || plateCamera_)) {
            add(Severity::Warning, "depth",
                fmt::format("one image serves {} frames, but the camera moves", frames_.size()));
        }
        const StoredDepth stored = depth.read(sample);
        addAll(depthSizeDoubts(stored.values.width(), stored.values.height(), plate()));
        options.full = stored.full;
        options.skyStored = stored.sky;
        options.focal_px = camera::projectionFromHorizontalFov(stored.values.width(), stored.values.height(),
                                                               glm::radians(s_.fov_deg.value_or(60)))
                               .focal_px;
        const depth::Depth metres = depth::sanitizeDepth(stored.values, options);
        if (metres.counts.filled == metres.counts.pixels) {
            add(Severity::Error, "depth",
                fmt::format("{}: none of its {} pixels has a depth above 0", depth.nameOf(sample),
                            metres.counts.pixels));
            return;
        }
        const depth::DepthStatistics range = depth::depthStatistics(metres.metres);
        add(Severity::Ok, "depth",
            range.finite == 0 ? fmt::format("{}: nothing but sky", depth.nameOf(sample))
                              : fmt::format("{}: {:.4g} to {:.4g} m, half of it within {:.4g} m, {:.0f} % sky",
                                            depth.nameOf(sample), range.min, range.max, range.median,
                                            100 * (1 - double(range.finite) / double(metres.counts.pixels))));
        addAll(depthDoubts({stored.values, stored.full, metres}, s_));
        if (!depth.isOne() && io::isFramePattern(s_.depth))
            checkSequence("depth", s_.depth, depth.frames(), stored.values.width(), stored.values.height());
    }

    void findPlateCamera()
    {
        try {
            plateCamera_ = readPlateCamera(s_, plate());
        } catch (const Error& error) {  // rendering goes on without one that nobody asked for
            add(s_.camera == "plate" ? Severity::Error : Severity::Warning, "camera", error.what(), "--camera none");
        }
    }

    void checkCamera()
    {
        const auto reading = hasCameraFile(s_) ? camera::readTrack(s_.camera, trackOptionsOf(s_))
                                               : plateCamera_.value_or(camera::TrackReading());
        const camera::Track& track = reading.track;
        if (track.empty()) return;
        add(Severity::Ok, "camera",
            fmt::format("{}{} with {} poses, frames {}-{}{}",
                        hasCameraFile(s_) ? fmt::format("'{}' is a ", s_.camera) : "the ", reading.format,
                        track.poses().size(), track.firstFrame(), track.lastFrame(),
                        track.isStatic() ? ", and stands still" : ""),
            hasCameraFile(s_) ? "" : "--camera none");
        for (const std::string& note : reading.notes) add(Severity::Warning, "camera", note);
        if (!s_.fov_deg && !track.poses().begin()->second.verticalFov)
            add(Severity::Note, "camera", "the track has no field of view; 60 deg across are taken", "--fov");
        if (reader_) addAll(trackDoubts(track, frames_, plate().fps, s_));
    }

    void checkLight()
    {
        if (!s_.env.empty())
            guarded("env", [&] {
                std::vector<FrameNumber> there = {0};
                if (io::isFramePattern(s_.env)) there = io::findFrames(s_.env);
                if (there.empty()) throw Error(ErrorCode::Input, "'{}': no frame of that pattern exists", s_.env);
                const std::string first = pathOf(s_.env, there.front());
                const io::ImageHeader header = io::readImageHeader(first);
                Finding finding = panoramaDoubt(header.width, header.height, header.isFloat);
                finding.sentence = fmt::format("'{}' {}", first, finding.sentence);
                found_.push_back(std::move(finding));
            });
        if (!s_.lights.empty())
            guarded("lights", [&] {
                const std::size_t lamps = readLights(s_.lights).size();
                add(lamps > 0 ? Severity::Ok : Severity::Warning, "lights",
                    fmt::format("'{}' has {} lamp{}", s_.lights, lamps, lamps == 1 ? "" : "s"));
            });
        if (!s_.mattes.empty())
            guarded("mattes", [&] {
                loadAtlas(s_.mattes);
                add(Severity::Ok, "mattes", fmt::format("'{}' is an atlas of strokes", s_.mattes));
            });
        if (!s_.gradeFrom.empty())
            guarded("grade-from", [&] {
                const io::ImageHeader header = io::readImageHeader(s_.gradeFrom);
                add(Severity::Ok, "grade-from",
                    fmt::format("'{}' is {}x{}", s_.gradeFrom, header.width, header.height));
            });
    }

    void checkOutput()
    {
        checkPreview(job_);
        const bool isPattern = io::isFramePattern(job_.output);
        if (frames_.size() > 1 && io::isImageName(job_.output) && !isPattern)
            throw Error(ErrorCode::Output,
                        "{}: is one image, but there are {} frames; name a pattern such as shot.%04d.exr", job_.output,
                        frames_.size());
        refuseWritingOverInputs(s_, job_, frames_);
        io::checkPlateWriter(job_.output, *reader_, writeOptionsOf(s_, job_));
        add(Severity::Ok, "output", fmt::format("'{}' can be written", job_.output));
        std::size_t existing = 0;
        std::error_code error;
        for (const FrameNumber frame : frames_) {
            existing += fs::exists(pathOf(job_.output, frame), error) ? 1 : 0;
            if (!isPattern) break;
        }
        if (existing > 0)
            add(Severity::Note, "output",
                fmt::format("{} file{} of that name {} replaced", existing, existing == 1 ? "" : "s",
                            existing == 1 ? "is" : "are"));
        const fs::path folder = fs::path(job_.output).parent_path();
        const fs::space_info space = fs::space(folder.empty() ? fs::path(".") : folder, error);
        if (!error) found_.push_back(spaceFinding(job_.output, bytesNeeded(), space.available));
    }

    /// Images as if nothing could be compressed; a movie as large as the plate's, or 4 bits a pixel.
    std::uint64_t bytesNeeded() const
    {
        const io::PlateInfo& info = plate();
        const std::uint64_t pixels = std::uint64_t(info.width) * std::uint64_t(info.height) * frames_.size();
        if (io::isMovieName(job_.output)) {
            std::error_code error;
            const std::uintmax_t size = info.isMovie ? fs::file_size(info.path, error) : 0;
            if (size == 0 || error) return pixels / 2;
            return std::uint64_t(double(size) * double(frames_.size()) / double(info.frames.size()));
        }
        const bool isExr = job_.output.ends_with(".exr");
        const std::uint64_t bytes = !isExr                                  ? (info.bitDepth > 8 ? 2 : 1)
                                    : s_.floatOutput || info.bitDepth == 32 ? 4
                                                                            : 2;
        constexpr std::uint64_t layerChannels = 4 * 4 + 3;
        return pixels * bytes * (info.hasAlpha || isExr ? 4 : 3) + (job_.layers ? pixels * bytes * layerChannels : 0);
    }

    const Settings& s_;
    const RainJobOptions& job_;
    FramePlan plan_;
    std::unique_ptr<io::PlateReader> reader_;  // nothing: the plate cannot be opened
    std::vector<FrameNumber> frames_;
    std::optional<camera::TrackReading> plateCamera_;
    std::vector<Finding> found_;
};

}  // namespace

std::vector<Finding> checkRainJob(const Settings& settings, const RainJobOptions& options)
{
    std::error_code error;
    if (options.plate == "-" || fs::is_fifo(options.plate, error) || options.plate == "/dev/stdin")
        throw Error(ErrorCode::InvalidArgument, "--check: '{}' is a pipe, which can be read only once", options.plate);
    return Check(settings, options).run();
}

bool holdsError(const std::vector<Finding>& findings)
{
    return std::any_of(findings.begin(), findings.end(),
                       [](const Finding& finding) { return finding.severity == Severity::Error; });
}

std::string findingsTable(const std::vector<Finding>& findings)
{
    std::string text;
    for (const Finding& finding : findings)
        text += fmt::format("{:<8} {:<11} {}{}\n", wordOf(finding.severity), finding.input, finding.sentence,
                            finding.flag.empty() ? "" : fmt::format("  [{}]", finding.flag));
    return text;
}

std::string findingsJson(const std::vector<Finding>& findings)
{
    using nlohmann::json;
    json list = json::array();
    const auto count = [&](Severity severity) {
        return std::count_if(findings.begin(), findings.end(),
                             [&](const Finding& f) { return f.severity == severity; });
    };
    for (const Finding& finding : findings)
        list.push_back({{"severity", wordOf(finding.severity)},
                        {"input", finding.input},
                        {"sentence", finding.sentence},
                        {"flag", finding.flag.empty() ? json() : json(finding.flag)}});
    const json object = {
        {"findings", list}, {"errors", count(Severity::Error)}, {"warnings", count(Severity::Warning)}};
    // A file name need not be UTF-8; JSON must.
    return object.dump(2, ' ', false, json::error_handler_t::replace);
}

Finding spaceFinding(const std::string& output, std::uint64_t needed, std::uint64_t free)
{
    const std::string sentence =
        fmt::format("'{}' may take up to {}; {} are free", output, amount(needed), amount(free));
    return {needed > free ? Severity::Warning : Severity::Ok, "output", sentence, ""};
}

Finding memoryFinding(std::uint64_t needed, std::uint64_t available)
{
    return {needed > available ? Severity::Warning : Severity::Ok, "plate",
            fmt::format("frames at work take about {} of memory; {} are available", amount(needed), amount(available)),
            ""};
}

}  // namespace virga::shot
