#include "server/Routes.h"

#include <fmt/format.h>

#include <new>
#include <nlohmann/json.hpp>

#include "core/Error.h"
#include "core/Log.h"
#include "server/EmbeddedFiles.h"
#include "server/Refusal.h"
#include "shot/Parameters.h"
#include "shot/SettingsText.h"

namespace virga::server {
namespace {

using nlohmann::json;

std::string dump(const json& value) { return value.dump(2, ' ', false, json::error_handler_t::replace) + "\n"; }

std::vector<std::string> partsOf(std::string_view path)
{
    std::vector<std::string> parts;
    while (!path.empty()) {
        path.remove_prefix(1);  // '/'
        const std::size_t slash = std::min(path.find('/'), path.size());
        parts.push_back(decoded(path.substr(0, slash), false));
        path.remove_prefix(slash);
    }
    if (!parts.empty() && parts.back().empty()) parts.pop_back();
    return parts;
}

void needMethod(const HttpRequest& request, std::initializer_list<const char*> allowed)
{
    for (const char* method : allowed)
        if (request.method == method || (request.method == "HEAD" && std::string_view(method) == "GET")) return;
    throw Refusal(405, "method", "{} {}: takes {}", request.method, shortened(request.path), fmt::join(allowed, ", "));
}

HttpAnswer file(const char* name, const char* type)
{
    HttpAnswer answer = HttpAnswer::of(200, type, std::string(embeddedFile(name)));
    answer.headers = {{"Cache-Control", "no-cache"},
                      {"Content-Security-Policy",
                       "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
                       "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"}};
    return answer;
}

const char* kindOfParameter(const shot::Parameter& p)
{
    if (p.choices != nullptr) return "choice";
    // In the order of Parameter::member's alternatives.
    constexpr const char* kinds[] = {"number", "number-or-auto", "whole", "switch", "text", "pair", "color"};
    static_assert(std::size(kinds) == std::variant_size_v<decltype(p.member)>);
    return kinds[p.member.index()];
}

}  // namespace

std::string parametersJson()
{
    json rows = json::array();
    const shot::Settings defaults;
    for (const shot::Parameter& p : shot::parameters()) {
        json row = {{"name", p.name}, {"group", p.group},           {"unit", p.unit},
                    {"help", p.help}, {"kind", kindOfParameter(p)}, {"default", shot::toJson(defaults, p)}};
        if (!p.isSwitch() && !std::holds_alternative<std::string shot::Settings::*>(p.member)) {
            row["least"] = p.least;
            row["most"] = p.most;
        }
        if (p.choices != nullptr) {
            json words = json::array();
            for (std::string_view rest = p.choices; !rest.empty();) {
                const std::size_t bar = std::min(rest.find('|'), rest.size());
                words.push_back(rest.substr(0, bar));
                rest.remove_prefix(std::min(bar + 1, rest.size()));
            }
            row["choices"] = words;
        }
        rows.push_back(std::move(row));
    }
    return dump(rows);
}

const char* Routes::kindOf(std::string_view path) noexcept
{
    if (path == "/healthz" || path == "/metrics") return "watch";
    if (path.find("/frames/") != std::string_view::npos) return "frame";
    if (path.find("/plates/") != std::string_view::npos) return "plate";
    if (path.starts_with("/sessions")) return "session";
    if (path == "/" || path == "/page.js" || path == "/page.css") return "page";
    return "other";
}

/// Sentences name files; where the served folder lies is nobody's business.
std::string Routes::withoutPaths(std::string sentence) const
{
    const std::string root = engine_.services().folder.path() + "/";
    if (root.size() > 1)
        for (std::size_t at = 0; (at = sentence.find(root, at)) != std::string::npos;) sentence.erase(at, root.size());
    return sentence;
}

HttpAnswer Routes::answer(const HttpRequest& request) noexcept
{
    const auto failed = [&](const Refusal& refusal) {
        HttpAnswer answer = HttpAnswer::json(refusal.status(), errorJson(refusal.code(), withoutPaths(refusal.what())));
        if (refusal.status() == 503) answer.headers.emplace_back("Retry-After", "1");
        return answer;
    };
    try {
        return route(request);
    } catch (const Refusal& refusal) {
        return failed(refusal);
    } catch (const Error& error) {
        return failed(refusalOf(error));
    } catch (const std::bad_alloc&) {
        return failed(Refusal(503, "memory", "out of memory"));
    } catch (const std::exception& error) {
        log::warning("request {}: {}", request.id, error.what());
        return failed(Refusal(500, "internal", "an internal error; the log has more"));
    }
}

HttpAnswer Routes::health() const
{
    const RenderDevice& device = engine_.services().device;
    const std::string fallback = device.fallback();
    return HttpAnswer::json(200, dump({{"status", "ok"},
                                       {"version", VIRGA_VERSION},
                                       {"device", device.used().empty() ? json() : json(device.used())},
                                       {"fallback", fallback.empty() ? json() : json(firstLine(fallback))},
                                       {"sessions", engine_.all().size()},
                                       {"uptime_s", engine_.uptime_s()}}));
}

HttpAnswer Routes::metrics() const
{
    Services& s = engine_.services();
    const Gauges gauges{.sessions = engine_.all().size(),
                        .connections = connections(),
                        .waiting = s.queue->waiting(),
                        .cachedBytes = s.pictures.bytes() + s.bodies.bytes(),
                        .sharedBytes = s.shared.bytes(),
                        .uptime_s = engine_.uptime_s()};
    return HttpAnswer::of(200, "text/plain; version=0.0.4; charset=utf-8", s.metrics.text(gauges));
}

HttpAnswer Routes::route(const HttpRequest& request)
{
    const std::vector<std::string> parts = partsOf(request.path);
    const std::string first = parts.empty() ? "" : parts[0];
    if (parts.size() <= 1 && first != "sessions") {
        struct Fixed {
            const char* name;
            HttpAnswer (*make)(const Routes&);
        };
        static constexpr Fixed fixed[] = {
            {"", [](const Routes&) { return file("index.html", "text/html; charset=utf-8"); }},
            {"page.js", [](const Routes&) { return file("page.js", "text/javascript; charset=utf-8"); }},
            {"page.css", [](const Routes&) { return file("page.css", "text/css; charset=utf-8"); }},
            {"openapi.json", [](const Routes&) { return file("openapi.json", "application/json"); }},
            {"parameters", [](const Routes&) { return HttpAnswer::json(200, parametersJson()); }},
            {"healthz", [](const Routes& r) { return r.health(); }},
            {"metrics", [](const Routes& r) { return r.metrics(); }},
        };
        for (const auto& [name, make] : fixed)
            if (first == name) {
                needMethod(request, {"GET"});
                return make(*this);
            }
    }
    if (first == "sessions") return session(request, parts);
    if (first == "shm" && parts.size() == 2) {
        needMethod(request, {"DELETE"});
        if (!engine_.services().shared.release(parts[1]))
            throw Refusal(404, "not-found", "there is no shared memory '{}'", shortened(parts[1]));
        return HttpAnswer{204, "", nullptr, {}};
    }
    throw Refusal(404, "not-found", "there is nothing at '{}'", shortened(request.path));
}

HttpAnswer Routes::session(const HttpRequest& request, const std::vector<std::string>& parts)
{
    if (parts.size() == 1) {
        needMethod(request, {"GET", "POST"});
        if (request.method == "POST") {
            const auto made =
                engine_.open(parseSessionDocument(request.body, request.contentType, parseQuery(request.query)));
            HttpAnswer answer = HttpAnswer::json(201, dump(made->describe()));
            answer.headers.emplace_back("Location", "/sessions/" + made->id());
            return answer;
        }
        json list = json::array();
        for (const auto& open : engine_.all()) list.push_back(open->summary());
        return HttpAnswer::json(200, dump(list));
    }
    const std::string& id = parts[1];
    if (parts.size() == 2) {
        needMethod(request, {"GET", "PATCH", "DELETE"});
        if (request.method == "DELETE") {
            engine_.close(id);
            return HttpAnswer{204, "", nullptr, {}};
        }
        const auto open = engine_.find(id);
        if (request.method == "PATCH") open->change(request.body);
        return HttpAnswer::json(200, dump(open->describe()));
    }
    if (parts.size() == 3 && parts[2] == "settings.toml") {
        needMethod(request, {"GET"});
        HttpAnswer answer = HttpAnswer::of(200, "application/toml", shot::settingsAsToml(engine_.find(id)->settings()));
        answer.headers.emplace_back("Content-Disposition", "attachment; filename=\"virga.toml\"");
        return answer;
    }
    if (parts.size() == 4 && parts[2] == "frames") {
        needMethod(request, {"GET"});
        return frame(request, id, parts[3], false);
    }
    if (parts.size() == 4 && parts[2] == "plates") {
        needMethod(request, {"GET", "PUT"});
        if (request.method != "PUT") return frame(request, id, parts[3], true);
        engine_.find(id)->putPlate(parseFrameNumber(parts[3]), request.contentType, request.body);
        return HttpAnswer{204, "", nullptr, {}};
    }
    throw Refusal(404, "not-found", "there is nothing at '{}'", shortened(request.path));
}

HttpAnswer Routes::frame(const HttpRequest& request, const std::string& id, const std::string& number, bool isPlate)
{
    const auto open = engine_.find(id);
    const FrameQuery query = parseFrameQuery(parseFrameNumber(number), parseQuery(request.query));
    const Format format = chooseFormat(request.accept);
    const FrameAnswer frame = isPlate ? open->plate(query, format, request.ifNoneMatch)
                                      : open->frame(query, format, request.ifNoneMatch, request.isGone);
    HttpAnswer answer;
    if (frame.isUnchanged) {
        answer.status = 304;
    } else if (frame.body) {
        answer.type = typeOf(format);
        answer.body = frame.body;
    } else {
        answer = HttpAnswer::json(200, dump({{"name", frame.sharedName},
                                             {"path", sharedPath(frame.sharedName)},
                                             {"bytes", frame.sharedBytes},
                                             {"type", rawType},
                                             {"release", "/shm/" + frame.sharedName}}));
        answer.type = sharedType;
    }
    answer.headers.emplace_back("ETag", frame.etag);
    answer.headers.emplace_back("Cache-Control", "private, no-cache");
    answer.headers.emplace_back("Vary", "Accept");
    answer.headers.emplace_back("Virga-Cache", frame.cache);
    answer.headers.emplace_back("Virga-Render-Ms", fmt::format("{:.2f}", frame.render_ms));
    answer.headers.emplace_back("Virga-Data-Window", fmt::format("{},{},{},{}", frame.data.x, frame.data.y,
                                                                 frame.data.width, frame.data.height));
    if (!isPlate) engine_.showed(open, query);
    return answer;
}

}  // namespace virga::server
