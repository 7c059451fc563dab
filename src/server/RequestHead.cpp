#include "server/RequestHead.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>

#include "core/Words.h"
#include "server/Refusal.h"

namespace virga::server {
namespace {

bool isTokenCharacter(unsigned char c)
{
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
           std::string_view("!#$%&'*+-.^_`|~").find(char(c)) != std::string_view::npos;
}

std::string_view trimmed(std::string_view text)
{
    while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
    while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
    return text;
}

/// The next line, without its CR LF.
std::string_view nextLine(std::string_view& rest)
{
    const std::size_t end = rest.find("\r\n");
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(std::min(rest.size(), end + 2));
    return line;
}

void takeRequestLine(RequestHead& head, std::string_view line)
{
    const std::size_t first = line.find(' '), last = line.rfind(' ');
    if (first == std::string_view::npos || first == last)
        throw Refusal(400, "bad-request", "the request line is not METHOD TARGET HTTP/1.1");
    head.method = line.substr(0, first);
    head.target = line.substr(first + 1, last - first - 1);
    const std::string_view version = line.substr(last + 1);
    if (version != "HTTP/1.1" && version != "HTTP/1.0")
        throw Refusal(505, "http-version", "'{}' is not HTTP/1.1", shortened(version));
    constexpr std::array known = {"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE"};
    if (std::find(known.begin(), known.end(), head.method) == known.end())
        throw Refusal(405, "method", "'{}' is no method of this server", shortened(head.method));
    if (head.target.size() > mostTargetBytes)
        throw Refusal(414, "target-too-long", "the target has {} bytes; at most {}", head.target.size(),
                      mostTargetBytes);
    if (!head.target.starts_with('/') ||
        std::any_of(head.target.begin(), head.target.end(), [](unsigned char c) { return c <= ' ' || c >= 0x7f; }))
        throw Refusal(400, "bad-request", "the target must begin with / and be ASCII without spaces");
}

std::uint64_t lengthFrom(std::string_view text)
{
    std::uint64_t length = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), length);
    if (error != std::errc() || end != text.data() + text.size() || text.empty())
        throw Refusal(400, "bad-request", "Content-Length '{}' is not a number of bytes", shortened(text));
    return length;
}

}  // namespace

std::size_t endOfHead(std::string_view bytes) noexcept
{
    const std::size_t at = bytes.find("\r\n\r\n");
    return at == std::string_view::npos ? at : at + 4;
}

RequestHead parseHead(std::string_view text)
{
    if (text.size() > mostHeadBytes)
        throw Refusal(431, "head-too-long", "the head of the request is over {} bytes", mostHeadBytes);
    RequestHead head;
    std::string_view rest = text;
    takeRequestLine(head, nextLine(rest));
    const auto once = [](std::string& field, const char* name, std::string_view value) {
        if (!field.empty()) throw Refusal(400, "bad-request", "{} is there twice", name);
        field = value;
    };
    while (true) {
        const std::string_view line = nextLine(rest);
        if (line.empty()) break;
        const std::size_t colon = line.find(':');
        const std::string_view name = line.substr(0, colon);
        if (colon == std::string_view::npos || name.empty() || !std::all_of(name.begin(), name.end(), isTokenCharacter))
            throw Refusal(400, "bad-request", "'{}' is not a header line", shortened(line));
        const std::string_view value = trimmed(line.substr(colon + 1));
        if (std::any_of(value.begin(), value.end(),
                        [](unsigned char c) { return (c < ' ' && c != '\t') || c == 0x7f; }))
            throw Refusal(400, "bad-request", "the header {} holds a control character", shortened(name));
        const std::string field = lowerCase(name);
        if (field == "content-length") {
            if (head.saysLength) throw Refusal(400, "bad-request", "Content-Length is there twice");
            head.contentLength = lengthFrom(value);
            head.saysLength = true;
        } else if (field == "transfer-encoding") {
            throw Refusal(411, "length-required", "a body needs a Content-Length; Transfer-Encoding is not taken");
        } else if (field == "content-encoding" && lowerCase(value) != "identity") {
            throw Refusal(415, "content-encoding", "a body in '{}' is not taken; send it as it is", shortened(value));
        } else if (field == "content-type" && lowerCase(value).starts_with("multipart/")) {
            throw Refusal(415, "content-type", "a body of several parts is not taken");
        } else if (field == "host") {
            once(head.host, "Host", value);
        } else if (field == "origin") {
            once(head.origin, "Origin", value);
        } else if (field == "authorization") {
            constexpr std::string_view scheme = "bearer ";
            if (!lowerCase(value.substr(0, scheme.size())).starts_with(scheme))
                throw Refusal(401, "token", "Authorization must be: Bearer TOKEN");
            once(head.token, "Authorization", trimmed(value.substr(scheme.size())));
        }
    }
    if ((head.method == "GET" || head.method == "HEAD") && head.contentLength > 0)
        throw Refusal(400, "bad-request", "a {} request has no body", head.method);
    return head;
}

bool isLoopbackName(std::string_view host) noexcept
{
    const std::size_t colon = host.rfind(':');
    if (colon != std::string_view::npos && host.find(']', colon) == std::string_view::npos)
        host = host.substr(0, colon);
    return host == "localhost" || host == "127.0.0.1" || host == "[::1]";
}

void admit(const RequestHead& head, const Admission& admission, bool needsToken)
{
    if (!admission.isPublic && !isLoopbackName(head.host))
        throw Refusal(403, "host", "Host '{}' is not this machine's: localhost, 127.0.0.1 or [::1]",
                      shortened(head.host));
    if (!head.origin.empty() && head.origin != "http://" + head.host && head.origin != "https://" + head.host)
        throw Refusal(403, "origin", "a page of '{}' may not ask here", shortened(head.origin));
    if (!needsToken) return;
    // All bytes are compared whatever they are: the time that it takes tells nothing of the token.
    unsigned char difference = head.token.size() == admission.token.size() ? 0 : 1;
    for (std::size_t i = 0; i < head.token.size(); ++i)
        difference = static_cast<unsigned char>(
            difference |
            (static_cast<unsigned char>(head.token[i]) ^
             static_cast<unsigned char>(admission.token[i % std::max<std::size_t>(admission.token.size(), 1)])));
    if (difference != 0 || admission.token.empty())
        throw Refusal(401, "token", "{}",
                      head.token.empty() ? "a token is needed: Authorization: Bearer TOKEN"
                                         : "the token is not the one of this server");
}

}  // namespace virga::server
