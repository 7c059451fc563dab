#include <cmath>

#include "fuzz/Targets.h"
#include "server/FrameQuery.h"
#include "server/RawFrame.h"
#include "server/Refusal.h"
#include "server/RequestHead.h"
#include "server/SessionDocument.h"

namespace virga::fuzz {

namespace {

/// As answers(), for parsers that refuse: a status of the client's own making, one line of text.
template <class Parse>
bool answersOrRefuses(Parse&& parse)
{
    try {
        return answers({ErrorCode::InvalidArgument, ErrorCode::Input}, parse);
    } catch (const server::Refusal& refusal) {
        require(refusal.status() >= 400 && refusal.status() < 500 + 6, "the status says that the request is at fault");
        require(refusal.status() < 500 || refusal.status() == 505, "no fault of a client's is the server's");
        require(refusal.what()[0] != 0, "the refusal says something");
        require(isOneLine(refusal.what()), "the sentence is one line of text", refusal.what());
        return false;
    }
}

void takeHead(std::string_view input)
{
    const std::string_view text = input.substr(0, std::min(server::endOfHead(input), input.size()));
    server::RequestHead head;
    if (!answersOrRefuses([&] { head = server::parseHead(text); })) return;
    require(head.target.starts_with('/') && head.target.size() <= server::mostTargetBytes, "the target is a path");
    require(isOneLine(head.host) || head.host.find('\t') != std::string::npos, "no field holds a line's end");
    answersOrRefuses([&] { server::admit(head, {"token", false}, true); });
}

void takeFrameQuery(std::string_view input)
{
    answersOrRefuses([&] {
        const server::FrameQuery query = server::parseFrameQuery(7, server::parseQuery(input));
        require(query.view.scale > 0 && query.view.scale <= 1, "the scale is a proxy's");
        require(query.view.later >= 0 && query.view.later < 1, "later is a part of a frame");
        require(query.quality >= 1 && query.quality <= 100, "the quality is one");
        require(query.priority >= -100 && query.priority <= 100, "the priority is within its bounds");
        require(!query.time_s || std::isfinite(*query.time_s), "the time is one");
        for (const Window& w : {query.view.region, query.dataWindow})
            require(w == Window{} || (w.width >= 1 && w.width <= 16384 && std::abs(w.x) <= 65536), "a window is one");
        shot::Settings settings;
        server::changeSettings(settings, query.changes);
    });
}

void takeAccept(std::string_view input)
{
    answersOrRefuses([&] { require(*server::typeOf(server::chooseFormat(input)) != 0, "the format has a type"); });
}

/// The first byte says which kind of document.
void takeDocument(std::string_view input)
{
    if (input.empty()) return;
    answersOrRefuses([&] {
        const bool isToml = (input[0] & 1) != 0;
        const auto document =
            server::parseSessionDocument(input.substr(1), isToml ? "application/toml" : "application/json",
                                         isToml ? server::Query{{"width", "64"}, {"height", "48"}} : server::Query{});
        require(document.platePath.empty() == document.posted.has_value(), "a session has one plate");
    });
}

void takeRaw(std::string_view input)
{
    answersOrRefuses([&] {
        const server::RawHeader header = server::parseRawHeader(input);
        require(header.bytes() == input.size(), "the header says how long the frame is");
        // Frames of few pixels are worth the while.
        if (std::int64_t(header.frameWidth) * header.frameHeight > 1 << 16) return;
        const ImageF image = server::readRaw(input);
        require(image.width() == header.frameWidth && image.height() == header.frameHeight, "the frame is whole");
    });
}

std::string rawSeed(bool isFloat)
{
    const ImageF pixels(3, 2, 4, 0.5f);
    const server::RawHeader header{{1, -1, 3, 2}, 8, 4, 12, isFloat, {"R", "G", "B", "A"}};
    const server::RawPlane planes[] = {{pixels, 0}, {pixels, 1}, {pixels, 2}, {pixels, 3}};
    std::string bytes(header.bytes(), '\0');
    server::writeRaw(header, planes, reinterpret_cast<std::byte*>(bytes.data()));
    return bytes;
}

}  // namespace

std::vector<Target> serverTargets()
{
    return {
        {"http-head",
         takeHead,
         {"GET /sessions/0123/frames/7?region=0,0,8,8 HTTP/1.1\r\nHost: localhost:8717\r\nAccept: image/png\r\n"
          "Authorization: Bearer token\r\nOrigin: http://localhost:8717\r\n\r\n",
          "POST /sessions HTTP/1.1\r\nHost: [::1]\r\nContent-Type: application/json\r\nContent-Length: 2\r\n\r\n{}"},
         {"Content-Length: ", "Transfer-Encoding: chunked\r\n", "\r\n\r\n", "HTTP/1.0", "multipart/form-data", "[",
          "]"}},
        {"frame-query",
         takeFrameQuery,
         {"region=1,-2,30,40&scale=0.5&layers=beauty,rain.Z&view=right&seed=9&time=1.25&colorspace=ACEScg&"
          "data_window=0,0,96,54&priority=-5&viewer=a%20b&samples=float&quality=80&later=0.5&set.wind=1,2"},
         {"%00", "%", "&", "=", "nan", "inf", "1e400", "set.", "all", ","}},
        {"accept",
         takeAccept,
         {"image/png;q=0.5, image/x-exr, */*;q=0.1", "application/x-virga-raw"},
         {"*/*", "image/*", ";q=", "0", "1.0", ",", "application/x-virga-shm"}},
        {"session-document",
         takeDocument,
         {"\x02{\"plate\": \"shot.%04d.exr\", \"settings\": {\"rate\": 12, \"wind\": [1, 2], \"fog\": \"auto\"}}",
          "\x02{\"plate\": {\"width\": 64, \"height\": 48}}", "\x01rate = 30\n[grade]\ndarken = 0.5\n"},
         {"null", "1e400", "[", "{", "\"auto\"", "\\u0000", "\\ud800"}},
        {"raw-frame",
         takeRaw,
         {rawSeed(false), rawSeed(true)},
         {std::string(4, '\xff'), std::string(8, '\0'), "R", "A"}}};
}

}  // namespace virga::fuzz
