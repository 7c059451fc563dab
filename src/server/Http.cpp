#include "server/Http.h"

#include <fcntl.h>
#include <httplib.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>
#include <unordered_map>

#include "core/Error.h"
#include "core/Log.h"
#include "core/Timer.h"
#include "server/Listeners.h"
#include "server/Refusal.h"

namespace virga::server {
namespace {

using Clock = std::chrono::steady_clock;

struct Connection {
    Descriptor socket;
    bool isTcp = false;
    std::string pending;         // read and not used: a head, what follows it
    Clock::time_point deadline;  // of the head, or of being idle
};

bool hasHungUp(int socket)
{
    pollfd watched{socket, POLLRDHUP, 0};
    return poll(&watched, 1, 0) > 0 && (watched.revents & (POLLRDHUP | POLLHUP | POLLERR | POLLNVAL)) != 0;
}

/// A connection as the library reads and writes it. What takes too long ends as if the client had hung up.
class PacedStream final : public httplib::Stream {
public:
    PacedStream(Connection& connection, const HttpLimits& limits)
        : connection_(connection), limits_(limits), start_(Clock::now())
    {
    }
    bool is_readable() const override { return true; }
    bool is_writable() const override { return !hasHungUp(connection_.socket.get()); }

    ssize_t read(char* to, std::size_t size) override
    {
        if (used_ < connection_.pending.size()) {
            const std::size_t count = std::min(size, connection_.pending.size() - used_);
            std::copy_n(connection_.pending.data() + used_, count, to);
            used_ += count;
            return ssize_t(count);
        }
        return moved(POLLIN, [&] { return recv(connection_.socket.get(), to, size, MSG_DONTWAIT); });
    }
    ssize_t write(const char* from, std::size_t size) override
    {
        if (!isWriting_) {  // rendering took what it took
            isWriting_ = true;
            start_ = Clock::now();
            bytes_ = 0;
        }
        return moved(POLLOUT, [&] { return send(connection_.socket.get(), from, size, MSG_DONTWAIT | MSG_NOSIGNAL); });
    }
    void get_remote_ip_and_port(std::string&, int&) const override {}
    void get_local_ip_and_port(std::string&, int&) const override {}
    socket_t socket() const override { return connection_.socket.get(); }

    /// Takes what was read off the connection's pending bytes.
    void settle()
    {
        connection_.pending.erase(0, used_);
        used_ = 0;
    }

private:
    template <class Move>
    ssize_t moved(short event, const Move& move)
    {
        while (true) {
            const ssize_t count = move();
            if (count >= 0) {
                bytes_ += std::size_t(count);
                return count;
            }
            if (errno == EINTR) continue;
            if (errno != EAGAIN && errno != EWOULDBLOCK) return -1;
            const auto most =
                limits_.slack + std::chrono::duration_cast<std::chrono::seconds>(
                                    std::chrono::duration<double>(double(bytes_) / limits_.leastBytesPerSecond));
            const auto left =
                std::chrono::duration_cast<std::chrono::milliseconds>(start_ + most - Clock::now()).count();
            if (left <= 0) return -1;
            pollfd watched{connection_.socket.get(), event, 0};
            poll(&watched, 1, int(std::min<long>(left, 1000)));
        }
    }

    Connection& connection_;
    const HttpLimits& limits_;
    Clock::time_point start_;
    std::size_t used_ = 0, bytes_ = 0;
    bool isWriting_ = false;
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

/// RFC 9110, 15; of the statuses that a head may get.
const char* phraseOf(int status) noexcept
{
    switch (status) {
        case 401: return "Unauthorized";
        case 403: return "Forbidden";
        case 405: return "Method Not Allowed";
        case 411: return "Length Required";
        case 413: return "Content Too Large";
        case 414: return "URI Too Long";
        case 415: return "Unsupported Media Type";
        case 431: return "Request Header Fields Too Large";
        case 505: return "HTTP Version Not Supported";
        default: return "Bad Request";
    }
}

constexpr const char* idHeader = "Virga-Request-Of-This-Server";

}  // namespace

HttpAnswer HttpAnswer::of(int status, std::string type, std::string body)
{
    return {status, std::move(type), std::make_shared<const std::string>(std::move(body)), {}};
}
HttpAnswer HttpAnswer::json(int status, std::string body) { return of(status, "application/json", std::move(body)); }

std::string errorJson(const char* code, std::string_view sentence)
{
    const nlohmann::json object = {{"code", code}, {"sentence", sentence}};
    return object.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

struct HttpServer::Impl {
    HttpLimits limits;
    Admission admission;
    Handler handler;
    Note note;
    std::vector<Listener> listeners;
    RequestReader reader;
    Descriptor epoll, wake;
    std::atomic<std::uint64_t> requests = 0;
    std::atomic<std::size_t> alive = 0;

    // Of the watching thread alone.
    std::unordered_map<int, std::unique_ptr<Connection>> idle;

    std::mutex mutex;
    std::condition_variable changed;
    std::deque<std::unique_ptr<Connection>> ready;      // with a whole head, for the threads
    std::vector<std::unique_ptr<Connection>> returned;  // answered, for the watching thread
    std::unordered_map<std::uint64_t, int> sockets;     // of requests under way
    std::vector<std::thread> threads;
    std::size_t free = 0;
    std::atomic<bool> ends = false;

    void accept(const Listener& listener);
    void watch(std::unique_ptr<Connection> connection);
    void take(int socket);
    void dispatch(std::unique_ptr<Connection> connection);
    void closeLate();
    void takeReturned();
    void work();
    bool serve(Connection& connection);
    void refuse(Connection& connection, const HttpRequest& request, const Refusal& refusal);
    void answer(const httplib::Request& request, httplib::Response& response);
    HttpRequest requestOf(const httplib::Request& request);
};

void HttpServer::Impl::accept(const Listener& listener)
{
    while (true) {
        Descriptor socket(accept4(listener.socket, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
        if (socket.get() < 0) return;
        if (alive >= limits.mostConnections) {
            // The one that has been idle the longest makes room; if all work, the new one goes.
            const auto oldest = std::min_element(idle.begin(), idle.end(), [](const auto& a, const auto& b) {
                return a.second->deadline < b.second->deadline;
            });
            if (oldest == idle.end()) continue;
            idle.erase(oldest);
            --alive;
        }
        const int yes = 1;
        if (listener.isTcp) setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
        auto connection = std::make_unique<Connection>();
        connection->socket = std::move(socket);
        connection->isTcp = listener.isTcp;
        ++alive;
        connection->deadline = Clock::now() + limits.headTime;
        watch(std::move(connection));
    }
}

void HttpServer::Impl::watch(std::unique_ptr<Connection> connection)
{
    const int socket = connection->socket.get();
    epoll_event event{};
    event.events = EPOLLIN | EPOLLRDHUP;
    event.data.fd = socket;
    if (epoll_ctl(epoll.get(), EPOLL_CTL_ADD, socket, &event) != 0) {
        --alive;
        return;
    }
    idle[socket] = std::move(connection);
}

/// Bytes have come on a connection that waits.
void HttpServer::Impl::take(int socket)
{
    const auto found = idle.find(socket);
    if (found == idle.end()) return;
    Connection& connection = *found->second;
    char bytes[8192];
    while (true) {
        const ssize_t count = recv(socket, bytes, sizeof bytes, MSG_DONTWAIT);
        if (count > 0) {
            if (connection.pending.empty()) connection.deadline = Clock::now() + limits.headTime;
            connection.pending.append(bytes, std::size_t(count));
            if (endOfHead(connection.pending) == std::string::npos && connection.pending.size() <= mostHeadBytes)
                continue;
            std::unique_ptr<Connection> owned = std::move(found->second);
            idle.erase(found);
            epoll_ctl(epoll.get(), EPOLL_CTL_DEL, socket, nullptr);
            dispatch(std::move(owned));
            return;
        }
        if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
        idle.erase(found);  // hung up
        --alive;
        return;
    }
}

void HttpServer::Impl::dispatch(std::unique_ptr<Connection> connection)
{
    {
        const std::lock_guard lock(mutex);
        ready.push_back(std::move(connection));
        if (free < ready.size() && threads.size() < limits.mostThreads) threads.emplace_back([this] { work(); });
    }
    changed.notify_one();
}

void HttpServer::Impl::closeLate()
{
    const auto now = Clock::now();
    for (auto at = idle.begin(); at != idle.end();) {
        if (at->second->deadline > now) {
            ++at;
            continue;
        }
        if (!at->second->pending.empty()) {
            const std::string sentence = errorJson(
                "head-late", fmt::format("the request's head did not come within {} s", limits.headTime.count()));
            const std::string text = fmt::format(
                "HTTP/1.1 408 Request Timeout\r\nContent-Type: application/json\r\nContent-Length: {}\r\n"
                "Connection: close\r\n\r\n{}",
                sentence.size(), sentence);
            [[maybe_unused]] const ssize_t sent =
                send(at->first, text.data(), text.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
        }
        at = idle.erase(at);
        --alive;
    }
}

void HttpServer::Impl::takeReturned()
{
    std::vector<std::unique_ptr<Connection>> back;
    {
        const std::lock_guard lock(mutex);
        back.swap(returned);
    }
    for (std::unique_ptr<Connection>& connection : back) {
        connection->deadline = Clock::now() + limits.idleTime;
        watch(std::move(connection));
    }
}

void HttpServer::Impl::work()
{
    std::unique_lock lock(mutex);
    while (true) {
        ++free;
        changed.wait(lock, [&] { return ends || !ready.empty(); });
        --free;
        if (ready.empty()) return;
        std::unique_ptr<Connection> connection = std::move(ready.front());
        ready.pop_front();
        lock.unlock();
        const bool staysOpen = serve(*connection);
        lock.lock();
        if (!staysOpen || ends) {
            connection.reset();
            --alive;
            continue;
        }
        // A client that has sent the next request already goes to the end of the line.
        if (endOfHead(connection->pending) != std::string::npos) {
            ready.push_back(std::move(connection));
            continue;
        }
        returned.push_back(std::move(connection));
        const std::uint64_t one = 1;
        [[maybe_unused]] const ssize_t told = write(wake.get(), &one, sizeof one);
    }
}

/// An answer before the library has seen the request; whatever body is on its way is not read.
void HttpServer::Impl::refuse(Connection& connection, const HttpRequest& request, const Refusal& refusal)
{
    const std::string body = errorJson(refusal.code(), refusal.what());
    const std::string text = fmt::format(
        "HTTP/1.1 {} {}\r\nContent-Type: application/json\r\nContent-Length: {}\r\nConnection: close\r\n"
        "{}Virga-Request: {}\r\n\r\n{}",
        refusal.status(), phraseOf(refusal.status()), body.size(),
        refusal.status() == 401 ? "WWW-Authenticate: Bearer\r\n" : "", request.id, body);
    PacedStream stream(connection, limits);
    stream.write(text.data(), text.size());
    // Closing on bytes that were not read would reset the connection and take the answer with it: a second's worth is
    // thrown away.
    const int socket = connection.socket.get();
    shutdown(socket, SHUT_WR);
    const auto until = Clock::now() + std::chrono::seconds(1);
    std::vector<char> bytes(65536);
    while (Clock::now() < until) {
        pollfd watched{socket, POLLIN, 0};
        if (poll(&watched, 1, 100) > 0 && recv(socket, bytes.data(), bytes.size(), MSG_DONTWAIT) <= 0) break;
    }
    note(request, refusal.status(), 0, body.size());
}

/// One request. False: the connection is to be closed.
bool HttpServer::Impl::serve(Connection& connection)
{
    HttpRequest begun;
    begun.id = ++requests;
    bool saysLength = false;
    try {
        const std::size_t end = endOfHead(connection.pending);
        const RequestHead head =
            parseHead(std::string_view(connection.pending).substr(0, std::min(end, connection.pending.size())));
        begun.method = head.method;
        begun.path = head.target.substr(0, head.target.find('?'));
        saysLength = head.saysLength;
        if (connection.isTcp)
            admit(head, admission, begun.path != "/" && begun.path != "/page.js" && begun.path != "/page.css");
        if (head.contentLength > limits.mostBodyBytes)
            throw Refusal(413, "body-too-large", "a body of {} bytes; at most {} are taken", head.contentLength,
                          limits.mostBodyBytes);
    } catch (const Refusal& refusal) {
        refuse(connection, begun, refusal);
        return false;
    }
    {
        const std::lock_guard lock(mutex);
        sockets[begun.id] = connection.socket.get();
    }
    PacedStream stream(connection, limits);
    bool isClosed = false;
    const bool isGood = reader.process(stream, ends, isClosed, [&](httplib::Request& request) {
        request.ranges.clear();  // frames come whole
        request.headers.erase(idHeader);
        request.set_header(idHeader, std::to_string(begun.id));
        if (!saysLength) request.set_header("Content-Length", "0");  // else the library reads until the client hangs up
    });
    stream.settle();
    {
        const std::lock_guard lock(mutex);
        sockets.erase(begun.id);
    }
    return isGood && !isClosed;
}

HttpRequest HttpServer::Impl::requestOf(const httplib::Request& from)
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
    int socket = -1;
    {
        const std::lock_guard lock(mutex);
        if (const auto found = sockets.find(request.id); found != sockets.end()) socket = found->second;
    }
    request.isGone = [socket] { return hasHungUp(socket); };
    return request;
}

void HttpServer::Impl::answer(const httplib::Request& from, httplib::Response& response)
{
    const Timer clock;
    HttpRequest request = requestOf(from);
    request.body = from.body;
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

HttpServer::HttpServer(std::vector<Listener> listeners, const HttpLimits& limits, Admission admission, Handler handler,
                       Note note)
    : impl_(std::make_unique<Impl>())
{
    Impl& m = *impl_;
    m.limits = limits;
    m.admission = std::move(admission);
    m.handler = std::move(handler);
    m.note = std::move(note);
    m.listeners = std::move(listeners);
    m.reader.set_payload_max_length(limits.mostBodyBytes);
    m.reader.set_keep_alive_max_count(std::size_t(1) << 30);
    const auto any = [&m](const httplib::Request& request, httplib::Response& response) {
        m.answer(request, response);
    };
    m.reader.Get(".*", any).Post(".*", any).Put(".*", any).Patch(".*", any).Delete(".*", any);
    m.epoll = Descriptor(epoll_create1(EPOLL_CLOEXEC));
    m.wake = Descriptor(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
    if (m.epoll.get() < 0 || m.wake.get() < 0) throw Error(ErrorCode::Output, "no descriptors are left");
    std::vector<int> watched = {m.wake.get()};
    for (const Listener& listener : m.listeners) watched.push_back(listener.socket);
    for (const int socket : watched) {
        epoll_event event{};
        event.events = EPOLLIN;
        event.data.fd = socket;
        epoll_ctl(m.epoll.get(), EPOLL_CTL_ADD, socket, &event);
    }
}

HttpServer::~HttpServer()
{
    {
        const std::lock_guard lock(impl_->mutex);
        impl_->ends = true;
    }
    impl_->changed.notify_all();
    for (std::thread& thread : impl_->threads) thread.join();
}

std::size_t HttpServer::connections() const { return impl_->alive; }

void HttpServer::run(const std::function<bool()>& ends, const std::function<void()>& everyTurn)
{
    Impl& m = *impl_;
    while (!ends()) {
        epoll_event events[64];
        const int count = epoll_wait(m.epoll.get(), events, 64, 100);
        for (int i = 0; i < count; ++i) {
            const int socket = events[i].data.fd;
            const auto listener = std::find_if(m.listeners.begin(), m.listeners.end(),
                                               [&](const Listener& l) { return l.socket == socket; });
            if (listener != m.listeners.end()) {
                m.accept(*listener);
            } else if (socket == m.wake.get()) {
                std::uint64_t told = 0;
                [[maybe_unused]] const ssize_t bytes = read(socket, &told, sizeof told);
            } else {
                m.take(socket);
            }
        }
        m.takeReturned();
        m.closeLate();
        everyTurn();
    }
}

}  // namespace virga::server
