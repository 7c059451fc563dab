// Run time against error, for the knobs that trade one for the other, against the reference (src/reference).
//   bench_curves OUT [--samples DIR] [--footage DIR] [--only KNOB] [--columns N] [--seeds N] [--opacity X]
// OUT gets curves.csv, a chart for each knob (KNOB.svg), index.html with charts, tables and pictures side by side, and
// the pictures (PNG; differences from the truth ten times as large, on grey). --footage (or VIRGA_FOOTAGE_DIR) adds
// clips. One frame of each clip, about 96 columns, three seeds. Error is of the beauty in scene-linear light: RMSE and
// maximum over the plate's mean, and mean FLIP. Of what rain and fog change (beauty - plate) the mean, the variance and
// the power in coarse and fine spatial frequencies (below and above an eighth of a cycle a pixel) are compared, as
// ratios to the truth's. Time is the renderer's on this machine's processor (--device cpu), the median of five frames.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <optional>
#include <string>

#include "core/Error.h"
#include "core/Log.h"
#include "core/Timer.h"
#include "curves/Knob.h"
#include "plot/Chart.h"

namespace {

using namespace virga;
using namespace bench;

struct Arguments {
    std::string out, samples = "samples", footage, only;
    int columns = 96, seeds = 3;
    std::optional<double> opacity;  ///< nothing: the default
};

struct Row {
    std::string knob, clip;
    double value;
    std::int64_t seed;
    double ms;
    PictureError error;
    double mean, variance, coarse, fine;  // of the effect, over the truth's
};

/// Mean, variance, coarse and fine power of green.
std::array<double, 4> momentsOf(const ImageF& effect)
{
    std::array<double, 4> moments{};
    for (int y = 0; y < effect.height(); ++y)
        for (int x = 0; x < effect.width(); ++x) moments[0] += double(effect.at(x, y, 1));
    moments[0] /= double(effect.width()) * effect.height();
    const std::vector<double> rings = powerSpectrum(effect, 1);
    const std::size_t middle = rings.size() / 4;  // rings end at half a cycle a pixel
    for (std::size_t k = 0; k < rings.size(); ++k) moments[k < middle ? 2 : 3] += rings[k];
    moments[1] = moments[2] + moments[3];
    return moments;
}

ImageF tenTimesApart(const ImageF& a, const ImageF& b)
{
    ImageF result(a.width(), a.height(), 4, 1);
    for (std::size_t i = 0; i < a.size(); ++i)
        if (i % 4 != 3) result.data()[i] = std::clamp(0.2f + 10 * (a.data()[i] - b.data()[i]), 0.0f, 1.0f);
    return result;
}

class Report {
public:
    explicit Report(const Arguments& arguments) : out_(arguments.out)
    {
        std::filesystem::create_directories(out_);
        csv_.open(out_ / "curves.csv");
        html_.open(out_ / "index.html");
        if (!csv_ || !html_) throw Error(ErrorCode::Output, "{}: cannot be written to", out_.string());
        csv_ << "knob,clip,value,seed,ms,rmse,max,flip,mean_ratio,variance_ratio,coarse_ratio,fine_ratio\n";
        html_ << "<!doctype html><meta charset=utf-8><title>Run time against error</title><style>body{font:15px "
                 "sans-serif;"
                 "max-width:1100px;margin:2em auto}img.p{width:260px;image-rendering:pixelated}td,th{padding:2px 9px;"
                 "text-align:right}</style><h1>Run time against error</h1>\n";
    }

    void begin(const Knob& knob)
    {
        fmt::print(html_, "<h2>{}</h2><p>Truth: {}. Default: {:g} {}.</p>\n", knob.title, knob.against, knob.standard,
                   knob.unit);
    }
    void add(const Row& r)
    {
        fmt::print(csv_, "{},{},{:g},{},{:.3f},{:.6g},{:.6g},{:.6g},{:.5f},{:.5f},{:.5f},{:.5f}\n", r.knob, r.clip,
                   r.value, r.seed, r.ms, r.error.rmse, r.error.most, r.error.flip, r.mean, r.variance, r.coarse,
                   r.fine);
        csv_.flush();
        rows_.push_back(r);
    }
    void pictures(const Knob& knob, const Clip& clip, double value, const ImageF& ours, const ImageF& truth)
    {
        const auto write = [&](const std::string& what, const ImageF& picture) {
            const std::string name = fmt::format("{}_{}_{}.png", knob.name, clip.name, what);
            io::writePng((out_ / name).string(), picture);
            fmt::print(html_, "<img class=p src='{}' title='{}'>\n", name, what);
        };
        fmt::print(html_, "<p>{} at {:g}: truth, rendered, ten times the difference<br>\n", clip.name, value);
        write("truth", truth);
        write(fmt::format("{:g}", value), ours);
        write(fmt::format("{:g}_difference", value), tenTimesApart(ours, truth));
    }
    void end(const Knob& knob);

private:
    std::filesystem::path out_;
    std::ofstream csv_, html_;
    std::vector<Row> rows_;  // of the knob at hand
};

/// Means over seeds, the chart and the table of one knob.
void Report::end(const Knob& knob)
{
    plot::Chart error{.title = knob.title, .subtitle = "against: " + knob.against};
    error.x = {.label = "time [ms a frame]", .scale = plot::Scale::Logarithmic};
    error.y = {.label = "RMSE over the plate's mean", .scale = plot::Scale::Logarithmic};
    std::vector<std::string> clips;
    for (const Row& r : rows_)
        if (std::find(clips.begin(), clips.end(), r.clip) == clips.end()) clips.push_back(r.clip);
    html_ << "<table><tr><th>clip<th>" << (knob.unit.empty() ? "value" : knob.unit)
          << "<th>ms<th>RMSE %<th>over seeds<th>max %<th>FLIP<th>mean<th>variance<th>coarse<th>fine</tr>\n";
    for (const std::string& clip : clips) {
        plot::Series line{.name = clip, .markers = true};
        for (const double value : knob.values) {
            std::vector<Row> same;
            std::copy_if(rows_.begin(), rows_.end(), std::back_inserter(same),
                         [&](const Row& r) { return r.clip == clip && r.value == value; });
            if (same.empty()) continue;
            const auto mean = [&](auto&& of) {
                return std::accumulate(same.begin(), same.end(), 0.0,
                                       [&](double s, const Row& r) { return s + of(r); }) /
                       double(same.size());
            };
            const double rmse = mean([](const Row&r) { return r.error.rmse; }),
                         ms = mean([](const Row&r) { return r.ms; });
            const auto [least, most] = std::minmax_element(
                same.begin(), same.end(), [](const Row& a, const Row& b) { return a.error.rmse < b.error.rmse; });
            line.x.push_back(ms);
            line.y.push_back(rmse);
            fmt::print(
                html_,
                "<tr><td>{}<td>{}{:g}{}<td>{:.1f}<td>{:.3f}<td>{:.3f} to {:.3f}<td>{:.1f}<td>{:.4f}<td>{:.3f}<td>"
                "{:.3f}<td>{:.3f}<td>{:.3f}</tr>\n",
                clip, value == knob.standard ? "<b>" : "", value, value == knob.standard ? "</b>" : "", ms, 100 * rmse,
                100 * least->error.rmse, 100 * most->error.rmse, 100 * mean([](const Row& r) { return r.error.most; }),
                mean([](const Row& r) { return r.error.flip; }), mean([](const Row& r) { return r.mean; }),
                mean([](const Row& r) { return r.variance; }), mean([](const Row& r) { return r.coarse; }),
                mean([](const Row& r) { return r.fine; }));
        }
        error.series.push_back(std::move(line));
    }
    html_ << "</table>\n";
    const std::vector<plot::Chart> charts = {error};
    std::ofstream(out_ / (knob.name + ".svg")) << plot::svg(charts);
    fmt::print(html_, "<p><img src='{}.svg'>\n", knob.name);
    html_.flush();
    rows_.clear();
}

void measure(const Knob& knob, const std::vector<Clip>& clips, const Arguments& arguments, Report& report)
{
    report.begin(knob);
    for (const Clip& clip : clips) {
        if (!knob.onFootage && &clip != &clips.front()) continue;
        for (std::int64_t seed = 1; seed <= (knob.hasSeeds ? arguments.seeds : 1); ++seed) {
            shot::Settings settings = clip.settings;
            settings.seed = seed;
            knob.prepare(settings);
            const Timer clock;
            Measured truth;
            if (knob.isOneTruth) truth = knob.truth(clip, settings, knob.standard);
            for (const double value : knob.values) {
                if (!knob.isOneTruth) truth = knob.truth(clip, settings, value);
                const Measured ours = knob.render(clip, settings, value);
                Row row{knob.name, clip.name, value, seed, ours.ms, {}, 1, 1, 1, 1};
                row.error = pictureError(ours.beauty, truth.beauty, meanOf(clip.frame.pixels));
                const auto a = momentsOf(ours.effect), b = momentsOf(truth.effect);
                if (b[1] > 0)  // else there is neither rain nor fog
                    row.mean = a[0] / b[0], row.variance = a[1] / b[1], row.coarse = a[2] / b[2],
                    row.fine = a[3] / b[3];
                report.add(row);
                const bool isShown = value == knob.standard || value == knob.values.front();
                if (isShown && seed == 1) report.pictures(knob, clip, value, ours.beauty, truth.beauty);
            }
            std::fprintf(stderr, "%s %s seed %d: %.0f s\n", knob.name.c_str(), clip.name.c_str(), int(seed),
                         clock.seconds());
        }
    }
    report.end(knob);
}

Arguments parse(int argc, char** argv)
{
    Arguments arguments;
    if (const char* folder = std::getenv("VIRGA_FOOTAGE_DIR")) arguments.footage = folder;
    for (int i = 1; i < argc; ++i) {
        const std::string flag = argv[i];
        if (!flag.starts_with("--")) {
            arguments.out = flag;
            continue;
        }
        if (++i >= argc) throw Error(ErrorCode::InvalidArgument, "{}: needs a value", flag);
        if (flag == "--samples")
            arguments.samples = argv[i];
        else if (flag == "--footage")
            arguments.footage = argv[i];
        else if (flag == "--only")
            arguments.only = argv[i];
        else if (flag == "--columns")
            arguments.columns = std::max(16, std::atoi(argv[i]));
        else if (flag == "--seeds")
            arguments.seeds = std::max(1, std::atoi(argv[i]));
        else if (flag == "--opacity")
            arguments.opacity = std::max(0.0, std::atof(argv[i]));
        else
            throw Error(ErrorCode::InvalidArgument,
                        "{}: not one of --samples, --footage, --only, --columns, --seeds, --opacity", flag);
    }
    if (arguments.out.empty()) throw Error(ErrorCode::InvalidArgument, "bench_curves OUT: name a folder");
    return arguments;
}

}  // namespace

int main(int argc, char** argv)
try {
    log::setLevel(log::Level::Quiet);  // of depth that is resampled, many times over
    const Arguments arguments = parse(argc, argv);
    std::vector<Clip> clips = readClips(arguments.samples, arguments.footage, arguments.columns);
    if (arguments.opacity)
        for (Clip& clip : clips) clip.settings.opacity = *arguments.opacity;
    Report report(arguments);
    for (const Knob& knob : knobs())
        if (arguments.only.empty() || knob.name == arguments.only) measure(knob, clips, arguments, report);
    return 0;
} catch (const Error& error) {
    std::fprintf(stderr, "bench_curves: %s\n", error.what());
    return exitCode(error.code());
}
