#include "server/HttpExchange.h"

#include <httplib.h>

#include <algorithm>
#include <mutex>
#include <unordered_map>

#include "core/Timer.h"

namespace virga::server {
namespace {

/// A transfer as the library sees it.
class Stream final : public httplib::Stream {
public:
    explicit Stream(PacedTransfer& transfer) : transfer_(transfer) {}
    bool is_readable() const override { return true; }
    bool is_writable() const override { return !hasHungUp(transfer_.socket()); }
    ssize_t read(char* to, std::size_t size) override { return transfer_.read(to, size); }
    ssize_t write(const char* from, std::size_t size) override { return transfer_.write(from, size); }
    void get_remote_ip_and_port(std::string&, int&) const override {}
    void get_local_ip_and_port(std::string&, int&) const override {}
    socket_t socket() const override { return transfer_.socket(); }

private:
    PacedTransfer& transfer_;
};

/// The library's server without its accepting loop and its threads.
class RequestReader final : public httplib::Server {
public:
    /// Without a listening socket of its own it takes itself to be shutting down and writes no bodies. The number is
    /// compared and never used.
    RequestReader() { svr_sock_ = 0; }
    bool process(httplib::Stream& stream, bool closes, bool& isClosed,
                 const std::function<void(httplib::Request&)>& setup)
    {
        return process_request(stream, closes, isClosed, setup);
    }
};

/// How a request finds its connection from inside the library; one that a client sends is taken off.
constexpr const char* idHeader = "Virga-Request-Of-This-Server";

}  // namespace

struct HttpExchange::Impl {
    Pace pace;
    HttpServer::Handler handler;
    HttpServer::Note note;
    RequestReader reader;
    std::mutex mutex;
    std::unordered_map<std::uint64_t, int> sockets;  // of requests under way

    void answer(const httplib::Request& from, httplib::Response& response);
    HttpRequest requestOf(const httplib::Request& from);
};

HttpExchange::HttpExchange(const HttpLimits& limits, HttpServer::Handler handler, HttpServer::Note note)
    : impl_(std::make_unique<Impl>())
{
    Impl& m = *impl_;
    m.pace = limits.pace;
    m.handler = std::move(handler);
    m.note = std::move(note);
    m.reader.set_payload_max_length(limits.mostBodyBytes);
    m.reader.set_keep_alive_max_count(std::size_t(1) << 30);
    const auto any = [&m](const httplib::Request& request, httplib::Response& response) {
        m.answer(request, response);
    };
    m.reader.Get(".*", any).Post(".*", any).Put(".*", any).Patch(".*", any).Delete(".*", any);
}

HttpExchange::~HttpExchange() = default;

bool HttpExchange::serve(Connection& connection, std::uint64_t id, const RequestHead& head, bool closes)
{
    Impl& m = *impl_;
    {
        const std::lock_guard lock(m.mutex);
        m.sockets[id] = connection.socket.get();
    }
    PacedTransfer transfer(connection, m.pace);
    Stream stream(transfer);
    bool isClosed = false;
    const bool isGood = m.reader.process(stream, closes, isClosed, [&](httplib::Request& request) {
        request.ranges.clear();  // frames come whole
        request.headers.erase(idHeader);
        request.set_header(idHeader, std::to_string(id));
        if (!head.saysLength)  // else the library reads until the client hangs up
            request.set_header("Content-Length", "0");
    });
    transfer.settle();
    const std::lock_guard lock(m.mutex);
    m.sockets.erase(id);
    return isGood && !isClosed;
}

HttpRequest HttpExchange::Impl::requestOf(const httplib::Request& from)
{
    HttpRequest request;
    request.id = std::strtoull(from.get_header_value(idHeader).c_str(), nullptr, 10);
    request.method = from.method;
    const std::size_t mark = from.target.find('?');
    request.path = from.target.substr(0, mark);
    if (mark != std::string::npos) request.query = from.target.substr(mark + 1);
    request.accept = from.get_header_value("Accept");
    request.contentType = from.get_header_value("Content-Type");
    request.ifNoneMatch = from.get_header_value("If-None-Match");
    request.body = from.body;
    const std::lock_guard lock(mutex);
    const auto found = sockets.find(request.id);
    request.isGone = [socket = found != sockets.end() ? found->second : -1] { return hasHungUp(socket); };
    return request;
}

void HttpExchange::Impl::answer(const httplib::Request& from, httplib::Response& response)
{
    const Timer clock;
    const HttpRequest request = requestOf(from);
    const HttpAnswer answer = handler(request);
    response.status = answer.status;
    for (const auto& [name, value] : answer.headers) response.set_header(name, value);
    response.set_header("Virga-Request", std::to_string(request.id));
    response.set_header("X-Content-Type-Options", "nosniff");
    const std::size_t bytes = answer.body ? answer.body->size() : 0;
    if (bytes > 0)
        response.set_content_provider(
            bytes, answer.type, [body = answer.body](std::size_t at, std::size_t length, httplib::DataSink& sink) {
                return sink.write(body->data() + at, std::min<std::size_t>(length, 1 << 20));
            });
    note(request, answer.status, clock.milliseconds(), bytes);
}

}  // namespace virga::server
