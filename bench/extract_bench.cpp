// Derained footage beside footage that never had rain: simple means, Garg & Nayar 2004, and what is in folders.
//   bench_extract pair RAIN_DIR CLEAN_DIR [--frames N] [--result NAME=DIR]... [--csv FILE]
// RAIN_DIR and CLEAN_DIR hold as many pictures of display-referred values, taken in the order of their names; --frames
// takes the first N. DIR holds clean.####.exr (scene-linear, brought back with the sRGB curve) or clean.####.png.
// Prints the machine, then a line for each way: PSNR, SSIM, precision, recall and F of streak pixels (the laws of
// tests/support/Scores.h) and wall-clock time a frame, without reading; least of three runs. Every way gets the same
// frames in the same run. CSV: name,psnr_db,ssim,precision,recall,f,ms_frame
#include <algorithm>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/Error.h"
#include "core/Timer.h"
#include "extract/GargNayar.h"
#include "io/Curve.h"
#include "io/ImageFile.h"
#include "io/Plate.h"
#include "matte/TemporalMedian.h"
#include "support/Scores.h"

namespace {

using namespace virga;
namespace fs = std::filesystem;
using Frames = std::vector<ImageF>;

constexpr const char* usage =
    "usage: bench_extract pair RAIN_DIR CLEAN_DIR [--frames N] [--result NAME=DIR]... [--csv FILE]";

struct Options {
    std::string rain, clean, csv;
    std::size_t frames = 0;  // 0: all
    std::vector<std::pair<std::string, std::string>> results;
};

Options parse(const std::vector<std::string>& words)
{
    Options options;
    if (words.size() < 3 || words[0] != "pair") throw Error(ErrorCode::InvalidArgument, usage);
    options.rain = words[1];
    options.clean = words[2];
    for (std::size_t i = 3; i < words.size(); i += 2) {
        if (i + 1 == words.size()) throw Error(ErrorCode::InvalidArgument, "{} needs a value", words[i]);
        const std::string &flag = words[i], &value = words[i + 1];
        if (flag == "--frames") {
            const auto end = std::from_chars(value.data(), value.data() + value.size(), options.frames);
            if (end.ec != std::errc() || end.ptr != value.data() + value.size() || options.frames < 3)
                throw Error(ErrorCode::InvalidArgument, "--frames '{}': must be a whole number, at least 3", value);
        } else if (flag == "--result") {
            const std::size_t equals = value.find('=');
            if (equals == std::string::npos || equals == 0)
                throw Error(ErrorCode::InvalidArgument, "--result '{}': must be NAME=DIR", value);
            options.results.emplace_back(value.substr(0, equals), value.substr(equals + 1));
        } else if (flag == "--csv") {
            options.csv = value;
        } else {
            throw Error(ErrorCode::InvalidArgument, "{}: not a flag; {}", flag, usage);
        }
    }
    return options;
}

/// Display-referred values; alpha is left out.
ImageF readCodes(const std::string& path)
{
    io::ImageHeader header;
    const ImageF file = io::readAllChannels(path, header, true);
    const int channels = file.channels() < 3 ? 1 : 3;
    ImageF codes(file.width(), file.height(), channels);
    for (int y = 0; y < file.height(); ++y)
        for (int x = 0; x < file.width(); ++x) std::copy_n(file.pixel(x, y), channels, codes.pixel(x, y));
    if (header.isFloat) io::encodeCurve(io::Curve::Srgb, codes.data(), codes.size());
    return codes;
}

Frames readFolder(const std::string& folder, std::size_t count)
{
    std::vector<std::string> files;
    std::error_code failed;
    for (const auto& entry : fs::directory_iterator(folder, failed))
        if (io::isImageName(entry.path().string())) files.push_back(entry.path().string());
    if (failed) throw Error(ErrorCode::Input, "{}: {}", folder, failed.message());
    std::sort(files.begin(), files.end());
    if (files.size() < std::max<std::size_t>(3, count))
        throw Error(ErrorCode::Input, "{}: {} pictures, must be at least {}", folder, files.size(),
                    std::max<std::size_t>(3, count));
    if (count > 0) files.resize(count);
    Frames frames;
    for (const std::string& file : files) {
        frames.push_back(readCodes(file));
        const ImageF &first = frames.front(), &last = frames.back();
        if (last.width() != first.width() || last.height() != first.height() || last.channels() != first.channels())
            throw Error(ErrorCode::Input, "{}: {} x {} pixels of {}, must be {} x {} of {} as the first", file,
                        last.width(), last.height(), last.channels(), first.width(), first.height(), first.channels());
    }
    return frames;
}

/// As many frames as `like`, with its channels: what came out of grey footage as colour is grey again.
Frames readResult(const std::string& folder, const Frames& like)
{
    const std::string exr = (fs::path(folder) / "clean.####.exr").string(),
                      png = (fs::path(folder) / "clean.####.png").string();
    std::string pattern = exr;
    std::vector<FrameNumber> numbers = io::findFrames(exr);
    if (numbers.empty()) numbers = io::findFrames(pattern = png);
    if (numbers.size() < like.size())
        throw Error(ErrorCode::Input, "{}: {} frames clean.####.exr or .png, must be at least {}", folder,
                    numbers.size(), like.size());
    Frames frames;
    for (std::size_t k = 0; k < like.size(); ++k) {
        const std::string file = io::framePath(pattern, numbers[k]);
        const ImageF codes = readCodes(file);
        ImageF frame(like[k].width(), like[k].height(), like[k].channels());
        if (codes.width() != frame.width() || codes.height() != frame.height())
            throw Error(ErrorCode::Input, "{}: {} x {} pixels, must be {} x {}", file, codes.width(), codes.height(),
                        frame.width(), frame.height());
        for (int y = 0; y < frame.height(); ++y)
            for (int x = 0; x < frame.width(); ++x) {
                const float* from = codes.pixel(x, y);
                float* to = frame.pixel(x, y);
                if (codes.channels() == frame.channels())
                    std::copy_n(from, frame.channels(), to);
                else if (codes.channels() == 1)
                    std::fill_n(to, frame.channels(), from[0]);
                else
                    to[0] = (from[0] + from[1] + from[2]) / 3;
            }
        frames.push_back(std::move(frame));
    }
    return frames;
}

Frames medianOfAll(const Frames& rainy) { return Frames(rainy.size(), matte::temporalMedian(rainy)); }

/// Rain only brightens: the frame where it is darker than the median of itself and its neighbours. At both ends the
/// three frames there.
Frames darkerOfFrameAndMedian(const Frames& rainy)
{
    Frames result;
    for (std::size_t n = 0; n < rainy.size(); ++n) {
        const std::size_t first = std::min(n > 0 ? n - 1 : 0, rainy.size() - 3);
        ImageF darker = matte::temporalMedian(std::span(rainy).subspan(first, 3));
        for (std::size_t i = 0; i < darker.size(); ++i)
            darker.data()[i] = std::min(darker.data()[i], rainy[n].data()[i]);
        result.push_back(std::move(darker));
    }
    return result;
}

class Table {
public:
    Table(const Frames& rainy, const Frames& clean, const std::string& csv) : rainy_(rainy), clean_(clean)
    {
        if (!csv.empty()) {
            csv_.open(csv);
            if (!csv_) throw Error(ErrorCode::Output, "{}: cannot be written", csv);
            csv_ << "name,psnr_db,ssim,precision,recall,f,ms_frame\n";
        }
        std::printf("%-40s %8s %8s %10s %7s %7s %9s\n", "", "PSNR dB", "SSIM", "precision", "recall", "F", "ms/frame");
    }

    void measure(const std::string& name, const std::function<Frames()>& derain)
    {
        double least = 1e30;
        Frames derained;
        for (int run = 0; run < 3; ++run) {
            const Timer timer;
            derained = derain();
            least = std::min(least, timer.milliseconds());
        }
        add(name, derained, least / double(rainy_.size()));
    }

    void add(const std::string& name, const Frames& derained, std::optional<double> milliseconds)
    {
        const double psnr = test::peakSignalToNoise(derained, clean_),
                     ssim = test::structuralSimilarity(derained, clean_);
        const test::Detection streaks = test::streakDetection(rainy_, derained, clean_);
        const std::string time = milliseconds ? fmt::format("{:.2f}", *milliseconds) : "";
        std::printf("%-40s %8.2f %8.4f %10.3f %7.3f %7.3f %9s\n", name.c_str(), psnr, ssim, streaks.precision(),
                    streaks.recall(), streaks.f(), time.empty() ? "-" : time.c_str());
        std::fflush(stdout);
        if (csv_.is_open())
            csv_ << fmt::format("{},{:.4f},{:.6f},{:.5f},{:.5f},{:.5f},{}\n", name, psnr, ssim, streaks.precision(),
                                streaks.recall(), streaks.f(), time);
    }

private:
    const Frames &rainy_, &clean_;
    std::ofstream csv_;
};

std::string processor()
{
    std::ifstream info("/proc/cpuinfo");
    for (std::string line; std::getline(info, line);)
        if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
    return "unknown processor";
}

void comparePair(const Options& options)
{
    const Frames rainy = readFolder(options.rain, options.frames), clean = readFolder(options.clean, options.frames);
    if (rainy.size() != clean.size() || rainy[0].size() != clean[0].size() || rainy[0].width() != clean[0].width())
        throw Error(ErrorCode::Input, "{}: {} frames of {} x {} x {}, must be {} of {} x {} x {} as in {}",
                    options.clean, clean.size(), clean[0].width(), clean[0].height(), clean[0].channels(), rainy.size(),
                    rainy[0].width(), rainy[0].height(), rainy[0].channels(), options.rain);
    std::printf("%s, %u threads; %zu frames of %d x %d x %d\n", processor().c_str(),
                std::thread::hardware_concurrency(), rainy.size(), rainy[0].width(), rainy[0].height(),
                rainy[0].channels());
    std::vector<std::pair<std::string, Frames>> results;
    for (const auto& [name, folder] : options.results) results.emplace_back(name, readResult(folder, rainy));
    Table table(rainy, clean, options.csv);
    table.add("rainy input", rainy, {});
    table.measure("median of all frames", [&] { return medianOfAll(rainy); });
    table.measure("min(frame; median of 3)", [&] { return darkerOfFrameAndMedian(rainy); });
    const auto measureGargNayar = [&](const std::string& name, const bench::GargNayarOptions& baseline) {
        table.measure(fmt::format("Garg & Nayar; c = {}{}", baseline.c, name),
                      [&] { return bench::gargNayar(rainy, baseline); });
    };
    for (const double c : {2.0, 3.0, 5.0}) measureGargNayar("", {.c = c});
    measureGargNayar("; equal to 12", {.c = 3, .equality = 12});
    measureGargNayar("; candidates alone", {.c = 2, .photometric = false, .directional = 0});
    measureGargNayar("; those; equal to 12", {.c = 2, .equality = 12, .photometric = false, .directional = 0});
    for (const auto& [name, derained] : results) table.add(name, derained, {});
}

}  // namespace

int main(int argc, char** argv)
try {
    comparePair(parse({argv + 1, argv + argc}));
    return 0;
} catch (const virga::Error& error) {
    std::fprintf(stderr, "bench_extract: %s\n", error.what());
    return virga::exitCode(error.code());
}
