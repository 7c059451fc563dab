#include "bench/Curves.h"

#include <fmt/format.h>

#include <algorithm>
#include <thread>

#include "bench/CurveReport.h"
#include "core/Error.h"
#include "core/Log.h"
#include "core/Timer.h"
#include "core/Words.h"

namespace virga::bench {
namespace {

std::vector<Knob> chosenKnobs(const std::vector<std::string>& only)
{
    std::vector<Knob> all = allKnobs();
    if (only.empty()) return all;
    std::vector<std::string> names;
    for (const Knob& knob : all) names.push_back(knob.name);
    std::vector<Knob> chosen;
    for (const std::string& wanted : only) {
        const auto knob = std::find_if(all.begin(), all.end(), [&](const Knob& k) { return k.name == wanted; });
        if (knob == all.end()) {
            std::string list;
            for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
            const std::string nearest = nearestWord(wanted, names);
            throw Error(ErrorCode::InvalidArgument, "--only '{}': no knob has that name; {}there are {}", wanted,
                        nearest.empty() ? "" : fmt::format("did you mean '{}'? ", nearest), list);
        }
        chosen.push_back(*knob);
    }
    return chosen;
}

std::string headingOf(const CurveOptions& options, const Surroundings& around)
{
    std::string clips;
    for (const Clip& clip : around.clips)
        clips += fmt::format("{}{} ({}x{})", clips.empty() ? "" : ", ", clip.name, clip.shot.width, clip.shot.height);
    return fmt::format("virga bench curves, {} threads. One frame each of {}; seeds 1 to {}{}.",
                       std::thread::hardware_concurrency(), clips, options.seeds,
                       options.opacity ? fmt::format("; --opacity {:g}", *options.opacity) : "");
}

}  // namespace

bool isStandard(const Knob& knob, const std::string& variant, const std::optional<double>& value)
{
    return value && variant == knob.standardVariant && (!variant.empty() || *value == knob.standard);
}

std::vector<Knob> allKnobs()
{
    std::vector<Knob> all;
    for (const auto some : {pictureKnobs, rainKnobs, strokeKnobs, lightKnobs, extractionKnobs})
        for (Knob& knob : some()) all.push_back(std::move(knob));
    return all;
}

void runCurves(const CurveOptions& options, const std::function<void(const std::string& knob, double seconds)>& told)
{
    std::vector<Knob> knobs = chosenKnobs(options.only);
    Surroundings around{.clips = readClips(options.samples, options.footage, options.columns), .seeds = options.seeds};
    if (options.opacity)
        for (Clip& clip : around.clips) clip.settings.opacity = *options.opacity;
    CurveReport report(options.out, headingOf(options, around));
    for (Knob& knob : knobs) {
        if (!options.values.empty()) {
            knob.values = options.values;
            if (std::find(knob.values.begin(), knob.values.end(), knob.standard) == knob.values.end())
                knob.values.push_back(knob.standard);
        }
        const Timer clock;
        knob.measure(knob, around, report.begin(knob));
        report.finish();
        told(knob.name, clock.seconds());
    }
}

}  // namespace virga::bench
