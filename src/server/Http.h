// HTTP/1.1 over any stream socket. cpp-httplib reads requests and writes answers; who gets a thread, and for how long,
// is decided here:
//
//   One thread watches all connections that wait for a request (epoll), so that a thousand idle ones cost a thousand
//   descriptors and nothing else. A request gets one of a limited number of threads once its head is there whole and
//   was found good (RequestHead.h); from then on its body and its answer must come and go at a least speed. A head that
//   does not come in time ends its connection.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/Connection.h"
#include "server/RequestHead.h"

namespace virga::server {

struct HttpRequest {
    std::uint64_t id = 0;  ///< of the server's run; in the log and in the answer's Virga-Request
    std::string method, path, query, body;
    std::string accept, contentType, ifNoneMatch;
    std::function<bool()> isGone;  ///< whether the client has hung up
};

struct HttpAnswer {
    int status = 200;
    std::string type;
    std::shared_ptr<const std::string> body;
    std::vector<std::pair<std::string, std::string>> headers;
    static HttpAnswer of(int status, std::string type, std::string body);
    static HttpAnswer json(int status, std::string body);
};

struct HttpLimits {
    std::uint64_t mostBodyBytes = std::uint64_t(256) << 20;
    std::size_t mostConnections = 4096;
    std::size_t mostThreads = 64;  ///< requests under way at a time; more wait
    std::chrono::seconds headTime{10}, idleTime{75};
    Pace pace{};  ///< of bodies and answers
};

struct Listener {
    int socket = -1;
    bool isTcp = false;  ///< asks for the token and looks at Host and Origin
};

class HttpServer {
public:
    using Handler = std::function<HttpAnswer(const HttpRequest&)>;
    /// Told of each answer, for log and metrics. ms: since the head was there.
    using Note = std::function<void(const HttpRequest&, int status, double ms, std::size_t bytes)>;

    HttpServer(std::vector<Listener> listeners, const HttpLimits& limits, Admission admission, Handler handler,
               Note note);
    ~HttpServer();
    HttpServer(const HttpServer&) = delete;
    HttpServer& operator=(const HttpServer&) = delete;

    /// Serves until `ends` says true, which is asked about ten times a second, as is `everyTurn` called; then takes no
    /// more requests and finishes those under way.
    void run(const std::function<bool()>& ends, const std::function<void()>& everyTurn);
    std::size_t connections() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// The body of an answer that is an error: {"code": ..., "sentence": ...}.
std::string errorJson(const char* code, std::string_view sentence);

}  // namespace virga::server
