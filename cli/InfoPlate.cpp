#include "InfoPlate.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/FrameRange.h"
#include "io/ColorConversion.h"
#include "io/MovieFacts.h"
#include "io/Plate.h"

namespace virga::cli {

using nlohmann::json;

namespace {

json orNull(const std::string& text) { return text.empty() ? json() : json(text); }

json streamJson(const io::MovieFacts::Stream& stream)
{
    json object = {{"kind", stream.kind},
                   {"codec", orNull(stream.codec)},
                   {"language", orNull(stream.language)},
                   {"title", orNull(stream.title)}};
    if (stream.kind == "sound") {
        object["channels"] = stream.channels;
        object["rate"] = stream.rate;
    }
    if (stream.kind != "attachment" && stream.kind != "cover") object["start"] = stream.start;
    return object;
}

void addMovie(const io::MovieFacts& facts, json& report)
{
    report["range"] = facts.range;
    report["range_is_guess"] = facts.isRangeGuessed;
    report["matrix"] = orNull(facts.matrix);
    report["matrix_is_guess"] = facts.isMatrixGuessed;
    report["primaries"] = orNull(facts.primaries);
    report["transfer"] = orNull(facts.transfer);
    report["chroma_location"] = orNull(facts.chromaLocation);
    report["timecode"] = orNull(facts.timecode);
    report["orientation"] = facts.orientation;
    report["streams"] = json::array();
    for (const auto& stream : facts.streams) report["streams"].push_back(streamJson(stream));
    report["chapters"] = json::array();
    for (const auto& chapter : facts.chapters)
        report["chapters"].push_back({{"start", chapter.start}, {"end", chapter.end}, {"title", chapter.title}});
    report["mastering_display"] = json();
    if (const auto& m = facts.masteringDisplay)
        report["mastering_display"] = {{"red", m->chromaticities[0]},  {"green", m->chromaticities[1]},
                                       {"blue", m->chromaticities[2]}, {"white", m->chromaticities[3]},
                                       {"min_cd_m2", m->least},        {"max_cd_m2", m->most}};
    report["light_level"] = json();
    if (const auto& light = facts.lightLevel)
        report["light_level"] = {{"max_content_cd_m2", light->content}, {"max_average_cd_m2", light->average}};
    report["dolby_vision_profile"] = facts.dolbyVisionProfile ? json(*facts.dolbyVisionProfile) : json();
}

std::string line(const char* name, const std::string& text) { return fmt::format("  {:<13} {}\n", name, text); }

/// "matrix bt709", "matrix bt709 (a guess)", "primaries not said".
std::string tagText(const json& report, const char* words, const char* key)
{
    if (report[key].is_null()) return fmt::format("{} not said", words);
    const auto guess = report.find(std::string(key) + "_is_guess");
    const bool isGuess = guess != report.end() && guess->get<bool>();
    return fmt::format("{} {}{}", words, report[key].get<std::string>(), isGuess ? " (a guess)" : "");
}

std::string streamText(const json& stream)
{
    const auto text = [&](const char* key) {
        return stream[key].is_null() ? std::string() : stream[key].get<std::string>();
    };
    std::vector<std::string> words;
    if (!text("codec").empty()) words.push_back(text("codec"));
    if (stream.contains("rate")) {
        const int channels = stream["channels"].get<int>();
        words.push_back(fmt::format("{} channel{}", channels, channels == 1 ? "" : "s"));
        words.push_back(fmt::format("{} Hz", stream["rate"].get<int>()));
    }
    if (!text("language").empty()) words.push_back(text("language"));
    if (!text("title").empty()) words.push_back(fmt::format("'{}'", text("title")));
    return line(text("kind").c_str(), fmt::format("{}", fmt::join(words, ", ")));
}

std::string movieText(const json& r)
{
    std::string text =
        line("tags", fmt::format("{}, {}, {}, {}, {}", tagText(r, "range", "range"), tagText(r, "matrix", "matrix"),
                                 tagText(r, "primaries", "primaries"), tagText(r, "transfer", "transfer"),
                                 tagText(r, "chroma at", "chroma_location")));
    if (const json& m = r["mastering_display"]; !m.is_null())
        text += line("mastered on",
                     fmt::format("{:g} to {:g} cd/m2, red {:.4g} {:.4g}, green {:.4g} {:.4g}, "
                                 "blue {:.4g} {:.4g}, white {:.4g} {:.4g}",
                                 m["min_cd_m2"].get<double>(), m["max_cd_m2"].get<double>(), m["red"][0].get<double>(),
                                 m["red"][1].get<double>(), m["green"][0].get<double>(), m["green"][1].get<double>(),
                                 m["blue"][0].get<double>(), m["blue"][1].get<double>(), m["white"][0].get<double>(),
                                 m["white"][1].get<double>()));
    if (const json& light = r["light_level"]; !light.is_null())
        text += line("light level", fmt::format("{} cd/m2 at most, {} on average in the brightest frame",
                                                light["max_content_cd_m2"].get<unsigned>(),
                                                light["max_average_cd_m2"].get<unsigned>()));
    if (!r["dolby_vision_profile"].is_null())
        text += line("Dolby Vision", fmt::format("profile {}", r["dolby_vision_profile"].get<int>()));
    if (!r["clean_aperture"].is_null()) text += line("clean part", r["clean_aperture"].get<std::string>());
    if (!r["timecode"].is_null()) text += line("timecode", r["timecode"].get<std::string>());
    if (r["orientation"] != "upright") text += line("shown", r["orientation"].get<std::string>());
    for (const json& stream : r["streams"]) text += streamText(stream);
    for (const json& chapter : r["chapters"])
        text += line("chapter", fmt::format("{:.3f} to {:.3f} s, '{}'", chapter["start"].get<double>(),
                                            chapter["end"].get<double>(), chapter["title"].get<std::string>()));
    return text;
}

}  // namespace

json plateReport(const std::string& file, const std::string& ocio, std::optional<int> stream)
{
    io::ReadOptions options;
    options.ocio = ocio;
    options.stream = stream;
    const auto reader = io::openPlate(file, options);
    const io::PlateInfo& info = reader->info();
    json report = {{"path", info.path},
                   {"format", info.format},
                   {"width", info.width},
                   {"height", info.height},
                   {"pixel_aspect", info.pixelAspect},
                   {"alpha", info.hasAlpha},
                   {"fps", info.fps},
                   {"variable_rate", info.isVariableRate},
                   {"scan", info.isMovie ? json(io::scanWords(info.scan)) : json()},
                   {"layers", info.layers},
                   {"views", info.views},
                   {"beside", info.beside},
                   {"video_streams", info.videoStreams},
                   {"frames", info.frames.size()},
                   {"frame_range", formatFrameRange(info.frames)},
                   {"colorspace", info.colorspace},
                   {"colorspace_source", info.colorspaceSource},
                   {"working_colorspace", info.workingColorspace},
                   {"ocio", info.colors->origin()}};
    if (const auto facts = io::movieFacts(*reader)) {
        addMovie(*facts, report);
        report["clean_aperture"] = orNull(info.cleanAperture);
    }
    return report;
}

std::string plateText(const json& r)
{
    const auto text = [&](const char* key) { return r[key].get<std::string>(); };
    const std::size_t frames = r["frames"].get<std::size_t>();
    std::string streams;
    for (const json& layer : r["layers"]) streams += line("--layer", layer.get<std::string>());
    for (const json& view : r["views"]) streams += line("--view", view.get<std::string>());
    if (const json& list = r["video_streams"]; list.size() > 1)
        for (std::size_t i = 0; i < list.size(); ++i)
            streams += line(fmt::format("--stream {}", i).c_str(), list[i].get<std::string>());
    const double aspect = r["pixel_aspect"].get<double>();
    return fmt::format("{}\n", text("path")) +
           line("picture", fmt::format("{} x {}{}{}, {}", r["width"].get<int>(), r["height"].get<int>(),
                                       aspect != 1 ? fmt::format(" (pixels {:.4g} wide)", aspect) : "",
                                       r["alpha"].get<bool>() ? " with alpha" : "", text("format"))) +
           line("frames", fmt::format("{} ({}), {:g} a second{}", frames, text("frame_range"), r["fps"].get<double>(),
                                      r["variable_rate"].get<bool>() ? " on average" : "")) +
           (r["scan"].is_null() ? std::string() : line("scan", text("scan"))) + streams +
           (r.contains("range") ? movieText(r) : std::string()) +
           line("colour space", fmt::format("{} ({})", text("colorspace"), text("colorspace_source"))) +
           line("worked on in", text("working_colorspace")) + line("configuration", text("ocio"));
}

}  // namespace virga::cli
