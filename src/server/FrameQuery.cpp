#include "server/FrameQuery.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <type_traits>

#include "core/Words.h"
#include "server/Refusal.h"

namespace virga::server {
namespace {

constexpr std::array layerNames = {"beauty", "rain", "splash", "fog", "plate", "rain.Z", "rain.motion", "all"};

std::vector<std::string_view> split(std::string_view text, char separator)
{
    std::vector<std::string_view> parts;
    while (true) {
        const std::size_t at = text.find(separator);
        parts.push_back(text.substr(0, at));
        if (at == std::string_view::npos) return parts;
        text.remove_prefix(at + 1);
    }
}

std::string_view trimmed(std::string_view text)
{
    while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
    while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
    return text;
}

template <class Number>
Number numberFrom(std::string_view name, std::string_view text, std::type_identity_t<Number> least,
                  std::type_identity_t<Number> most)
{
    Number value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !(value >= least && value <= most))
        throw Refusal(400, "invalid-argument", "{} '{}': must be a number, {} to {}", name, shortened(text), least,
                      most);
    return value;
}

int hexDigit(char c)
{
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
}

void checkName(std::string_view name, std::string_view text, std::size_t most)
{
    if (text.size() > most)
        throw Refusal(400, "invalid-argument", "{} '{}': must be at most {} letters", name, shortened(text), most);
}

}  // namespace

std::string decoded(std::string_view text, bool plus)
{
    std::string result;
    for (std::size_t i = 0; i < text.size(); ++i) {
        char c = text[i];
        if (c == '+' && plus) c = ' ';
        if (c == '%') {
            const int high = i + 2 < text.size() ? hexDigit(text[i + 1]) : -1;
            const int low = high >= 0 ? hexDigit(text[i + 2]) : -1;
            if (low < 0) throw Refusal(400, "bad-request", "'{}': an escape is % and two hex digits", shortened(text));
            c = char(16 * high + low);
            i += 2;
        }
        if (static_cast<unsigned char>(c) < ' ' || c == 0x7f)
            throw Refusal(400, "bad-request", "the target holds a control character");
        result += c;
    }
    return result;
}

Query parseQuery(std::string_view text)
{
    Query query;
    if (text.empty()) return query;
    for (const std::string_view part : split(text, '&')) {
        if (part.empty()) continue;
        if (query.size() >= 200) throw Refusal(400, "bad-request", "the query holds more than 200 words");
        const std::size_t equals = part.find('=');
        query.emplace_back(decoded(part.substr(0, equals), true),
                           equals == std::string_view::npos ? "" : decoded(part.substr(equals + 1), true));
    }
    return query;
}

const char* typeOf(Format format) noexcept
{
    switch (format) {
        case Format::Exr: return "image/x-exr";
        case Format::Png: return "image/png";
        case Format::Jpeg: return "image/jpeg";
        case Format::Raw: return rawType;
        case Format::Shared: return sharedType;
    }
    return "";
}

Format chooseFormat(std::string_view accept)
{
    if (trimmed(accept).empty()) return Format::Png;
    constexpr std::array order = {Format::Png, Format::Jpeg, Format::Exr, Format::Raw, Format::Shared};
    double best = 0;
    std::optional<Format> chosen;
    for (const Format format : order) {
        double weight = 0;
        int match = -1;  // how closely the entry names it: 0 */*, 1 image/*, 2 the type
        for (const std::string_view entry : split(accept, ',')) {
            const std::vector<std::string_view> parts = split(entry, ';');
            const std::string type = lowerCase(trimmed(parts.front()));
            const std::string_view own = typeOf(format);
            const bool isExrAlias = format == Format::Exr && (type == "image/exr" || type == "image/aces");
            const int fit = type == own || isExrAlias                                  ? 2
                            : format == Format::Shared                                 ? -1
                            : type == std::string(own.substr(0, own.find('/'))) + "/*" ? 1
                            : type == "*/*"                                            ? 0
                                                                                       : -1;
            if (fit <= match) continue;
            match = fit;
            weight = 1;
            for (const std::string_view parameter : std::vector(parts.begin() + 1, parts.end())) {
                const std::string_view p = trimmed(parameter);
                if (!p.starts_with("q=")) continue;
                const std::string_view number = p.substr(2);
                double q = 0;
                const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), q);
                weight = error == std::errc() && q >= 0 && q <= 1 ? q : 0;
            }
        }
        if (match >= 0 && weight > best) {
            best = weight;
            chosen = format;
        }
    }
    if (!chosen)
        throw Refusal(406, "not-acceptable", "Accept '{}' names none of {}, {}, {}, {} and {}", shortened(accept),
                      typeOf(Format::Exr), typeOf(Format::Png), typeOf(Format::Jpeg), rawType, sharedType);
    return *chosen;
}

Window parseWindow(const char* name, std::string_view text)
{
    const std::vector<std::string_view> parts = split(text, ',');
    if (parts.size() != 4)
        throw Refusal(400, "invalid-argument", "{} '{}': must be x,y,width,height", name, shortened(text));
    return {numberFrom<int>(name, parts[0], -65536, 65536), numberFrom<int>(name, parts[1], -65536, 65536),
            numberFrom<int>(name, parts[2], 1, 16384), numberFrom<int>(name, parts[3], 1, 16384)};
}

FrameNumber parseFrameNumber(std::string_view text)
{
    return numberFrom<FrameNumber>("frame", text, -1'000'000'000'000'000, 1'000'000'000'000'000);
}

bool FrameQuery::wants(std::string_view layer) const
{
    if (layers.empty()) return layer == "beauty";
    return std::any_of(layers.begin(), layers.end(), [&](const auto& name) { return name == layer || name == "all"; });
}

bool FrameQuery::wantsLayers() const
{
    return std::any_of(layers.begin(), layers.end(), [](const auto& name) { return name != "beauty"; });
}

FrameQuery parseFrameQuery(FrameNumber frame, const Query& query)
{
    FrameQuery result;
    result.frame = frame;
    for (const auto& [name, value] : query) {
        if (name == "time") {
            result.time_s = numberFrom<double>("time", value, 0.0, 1e9);
        } else if (name == "later") {
            result.view.later = numberFrom<double>("later", value, 0.0, 0.999999);
        } else if (name == "region") {
            result.view.region = parseWindow("region", value);
        } else if (name == "data_window") {
            result.dataWindow = parseWindow("data_window", value);
        } else if (name == "scale") {
            result.view.scale = numberFrom<double>("scale", value, 1.0 / 64, 1.0);
        } else if (name == "layers") {
            for (const std::string_view layer : split(value, ',')) {
                if (std::find(layerNames.begin(), layerNames.end(), layer) == layerNames.end())
                    throw Refusal(400, "invalid-argument", "layers '{}': must be of {}", shortened(layer),
                                  fmt::join(layerNames, ", "));
                if (!result.wants(layer) || result.layers.empty()) result.layers.emplace_back(layer);
            }
        } else if (name == "colorspace") {
            checkName(name, value, 200);
            result.colorspace = value;
        } else if (name == "samples") {
            if (value != "half" && value != "float")
                throw Refusal(400, "invalid-argument", "samples '{}': must be half or float", shortened(value));
            result.isFloat = value == "float";
        } else if (name == "quality") {
            result.quality = numberFrom<int>("quality", value, 1, 100);
        } else if (name == "viewer") {
            checkName(name, value, 64);
            result.viewer = value;
        } else if (name == "priority") {
            result.priority = numberFrom<int>("priority", value, -100, 100);
        } else if (name == "seed" || name == "view") {
            result.changes.emplace_back(name, value);
        } else if (name.starts_with("set.")) {
            result.changes.emplace_back(name.substr(4), value);
        } else {
            static const std::vector<std::string> known = {"time",     "later",      "region",  "data_window", "scale",
                                                           "layers",   "colorspace", "samples", "quality",     "viewer",
                                                           "priority", "seed",       "view"};
            const std::string nearest = nearestWord(name, known);
            throw Refusal(400, "invalid-argument", "a frame has no '{}'{}", shortened(name),
                          nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest));
        }
    }
    return result;
}

}  // namespace virga::server
