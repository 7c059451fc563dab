// The head of an HTTP/1.1 request (RFC 9112), judged before a byte of its body is read and before the HTTP library sees
// it. Stricter than the RFC: what two readers could take for different things is refused.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace virga::server {

constexpr std::size_t mostHeadBytes = 16384, mostTargetBytes = 4096;

struct RequestHead {
    std::string method, target;
    std::uint64_t contentLength = 0;  ///< of the body; 0 where the head does not say
    bool saysLength = false;
    std::string host, origin, token;  ///< as sent, empty if not; the token without "Bearer "
};

/// The place after the empty line that ends a head; npos while it is not there.
std::size_t endOfHead(std::string_view bytes) noexcept;

/// head: with its empty line. Throws Refusal: 400 for what is no request; 405 for a method that nobody has; 411 for a
/// body without a length; 414, 431 for too long a target or a head; 415 for a body that is compressed or of several
/// parts; 505 for another HTTP.
RequestHead parseHead(std::string_view head);

/// Who may ask over TCP. A page of another site that a browser shows on this machine must not reach the server: neither
/// by asking from there (Origin) nor by a name of its own that it points here (DNS rebinding: Host).
struct Admission {
    std::string token;
    bool isPublic = false;  ///< any name in Host is fine
};
/// Whether requests to this host may come over TCP. Without a port; "localhost", "127.0.0.1", "[::1]".
bool isLoopbackName(std::string_view host) noexcept;
/// Throws Refusal 403 for Host and Origin, 401 without the right token. needsToken: false for the page itself, which
/// says nothing of this machine.
void admit(const RequestHead& head, const Admission& admission, bool needsToken);

}  // namespace virga::server
