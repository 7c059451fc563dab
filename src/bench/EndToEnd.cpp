#include "bench/EndToEnd.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "bench/ChildProcess.h"
#include "core/Error.h"
#include "io/AtomicFile.h"
#include "io/Plate.h"

namespace virga::bench {
namespace {

constexpr const char* codecs[] = {"libx264", "libx265", "libsvtav1", "libvpx-vp9"};

EndToEndTime medianOf(const std::vector<ChildRun>& runs)
{
    const auto middle = [&](auto&& of) {
        std::vector<double> values;
        for (const ChildRun& run : runs) values.push_back(of(run));
        std::sort(values.begin(), values.end());
        return values[values.size() / 2];
    };
    return {middle([](const ChildRun& r) { return r.seconds; }),
            middle([](const ChildRun& r) { return r.processors; })};
}

void check(const EndToEndOptions& options)
{
    if (std::find(std::begin(codecs), std::end(codecs), options.codec) == std::end(codecs))
        throw Error(ErrorCode::InvalidArgument, "--codec '{}': must be one whose quality is a CRF: {}", options.codec,
                    fmt::join(codecs, ", "));
    if (!std::filesystem::exists(options.movie)) throw Error(ErrorCode::Input, "'{}': no such file", options.movie);
    if (options.out.empty()) return;
    std::error_code problem;
    std::filesystem::create_directories(options.out, problem);
    if (problem) throw Error(ErrorCode::Output, "'{}': the folder cannot be made: {}", options.out, problem.message());
    io::checkOutputFolder(options.out + "/rain.mp4");
}

void readReport(EndToEndReport& report, const std::string& text)
{
    const auto json = nlohmann::json::parse(text);
    report.frames = json.at("frames").get<std::size_t>();
    report.startSeconds = json.at("start_seconds").get<double>();
    report.render_ms = json.at("render_ms_per_frame").get<double>();
    report.strokes = json.at("strokes_per_frame").get<double>();
    report.device = json.at("device").get<std::string>();
    report.passes_ms = json.at("passes").get<std::map<std::string, double>>();
}

nlohmann::ordered_json timeJson(const EndToEndTime& time, std::size_t frames)
{
    return {{"seconds", time.seconds},
            {"processor_seconds", time.processors},
            {"ms_per_frame", 1e3 * time.seconds / double(frames)}};
}

}  // namespace

EndToEndReport runEndToEnd(const EndToEndOptions& options)
{
    check(options);
    const TemporaryFolder work;
    const std::string ending = options.codec == "libvpx-vp9" ? ".webm" : ".mp4";
    const std::string folder = options.out.empty() ? work.path() : options.out;
    const std::string plain = folder + "/plain" + ending, rain = folder + "/rain" + ending,
                      quality = fmt::format("{:g}", options.quality);
    // As far apart as virga rain sets key frames.
    const std::string keyFrames =
        std::to_string(std::max(1L, std::lround(2 * io::openPlate(options.movie, {})->info().fps)));
    const std::vector<std::string> reading = {"ffmpeg", "-v", "error", "-y", "-i", options.movie};
    const auto with = [](std::vector<std::string> words, const std::vector<std::string>& more) {
        words.insert(words.end(), more.begin(), more.end());
        return words;
    };
    const auto decode = with(reading, {"-map", "0:v:0", "-f", "null", "-"});
    // Rate 0 is VP9's way to say that the CRF alone counts; to the others it is no limit.
    const auto transcode =
        with(reading, {"-map", "0:v:0", "-c:v", options.codec, "-crf", quality, "-b:v", "0", "-g", keyFrames, plain});
    const auto render = with({options.virga, "rain", options.movie, "-o", rain, "--codec", options.codec, "--quality",
                              quality, "--device", options.device, "--json", "--quiet"},
                             options.rainFlags);
    std::vector<ChildRun> decodes, transcodes, renders;
    for (int run = 0; run < options.runs; ++run) {
        decodes.push_back(runChild(decode, work.path()));
        transcodes.push_back(runChild(transcode, work.path()));
        renders.push_back(runChild(render, work.path()));
    }
    EndToEndReport report;
    report.decode = medianOf(decodes);
    report.plain = medianOf(transcodes);
    report.rain = medianOf(renders);
    readReport(report, renders.back().output);
    return report;
}

std::string endToEndText(const EndToEndReport& report)
{
    const double frames = double(std::max<std::size_t>(report.frames, 1));
    std::string text = fmt::format("{} frames, {:.0f} strokes a frame; {}\n", report.frames, report.strokes,
                                   report.device.empty() ? "nothing is drawn" : report.device);
    const auto line = [&](const char* what, const EndToEndTime& time) {
        text += fmt::format("{:<18}{:8.2f} s {:8.1f} ms a frame {:8.1f} ms of all processors\n", what, time.seconds,
                            1e3 * time.seconds / frames, 1e3 * time.processors / frames);
    };
    line("ffmpeg, decode", report.decode);
    line("ffmpeg, transcode", report.plain);
    line("virga rain", report.rain);
    text += fmt::format("ratio             {:8.2f}; of all processors' time {:.2f}\n", report.ratio(),
                        report.processorRatio());
    text += fmt::format("virga rain        start {:.2f} s; rendering {:.1f} ms a frame:", report.startSeconds,
                        report.render_ms);
    std::vector<std::pair<std::string, double>> passes(report.passes_ms.begin(), report.passes_ms.end());
    std::sort(passes.begin(), passes.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
    for (const auto& [name, ms] : passes) text += fmt::format(" {} {:.2f}", name, ms);
    return text + "\n";
}

nlohmann::ordered_json endToEndJson(const EndToEndReport& report)
{
    return {{"ratio", report.ratio()},
            {"processor_ratio", report.processorRatio()},
            {"frames", report.frames},
            {"decode", timeJson(report.decode, report.frames)},
            {"transcode", timeJson(report.plain, report.frames)},
            {"rain", timeJson(report.rain, report.frames)},
            {"start_seconds", report.startSeconds},
            {"render_ms_per_frame", report.render_ms},
            {"passes", report.passes_ms},
            {"strokes_per_frame", report.strokes},
            {"device", report.device}};
}

}  // namespace virga::bench
