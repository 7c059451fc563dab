#include "server/Http.h"

#include <fcntl.h>
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
#include "server/HttpExchange.h"
#include "server/Listeners.h"
#include "server/Refusal.h"

namespace virga::server {
namespace {

using Clock = std::chrono::steady_clock;

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
        case 503: return "Service Unavailable";
        case 431: return "Request Header Fields Too Large";
        case 505: return "HTTP Version Not Supported";
        default: return "Bad Request";
    }
}

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
    Note note;
    std::vector<Listener> listeners;
    std::unique_ptr<HttpExchange> exchange;
    Descriptor epoll, wake;
    std::atomic<std::uint64_t> requests = 0, bodyBytes = 0;  // of all; of those under way
    std::atomic<std::size_t> alive = 0;

    // Of the watching thread alone.
    std::unordered_map<int, std::unique_ptr<Connection>> idle;

    std::mutex mutex;
    std::condition_variable changed;
    std::deque<std::unique_ptr<Connection>> ready;      // with a whole head, for the threads
    std::vector<std::unique_ptr<Connection>> returned;  // answered, for the watching thread
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
};

void HttpServer::Impl::accept(const Listener& listener)
{
    while (true) {
        Descriptor socket(accept4(listener.socket, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
        const bool isFull = socket.get() < 0 && (errno == EMFILE || errno == ENFILE);
        if (socket.get() < 0 && !isFull) return;
        if (isFull || alive >= limits.mostConnections) {
            // The one that has been idle the longest makes room; if all work, the new one goes, or waits where there is
            // not even a descriptor to take it with.
            const auto oldest = std::min_element(idle.begin(), idle.end(), [](const auto& a, const auto& b) {
                return a.second->deadline < b.second->deadline;
            });
            if (oldest == idle.end() && !isFull) continue;
            if (oldest == idle.end()) return;
            idle.erase(oldest);
            --alive;
            if (isFull) continue;
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
    PacedTransfer transfer(connection, limits.pace);
    transfer.write(text.data(), text.size());
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
    RequestHead head;
    try {
        const std::string_view pending = connection.pending;
        head = parseHead(pending.substr(0, std::min(endOfHead(pending), pending.size())));
        begun.method = head.method;
        begun.path = head.target.substr(0, head.target.find('?'));
        if (connection.isTcp)
            admit(head, admission, begun.path != "/" && begun.path != "/page.js" && begun.path != "/page.css");
        if (head.contentLength > limits.mostBodyBytes)
            throw Refusal(413, "body-too-large", "a body of {} bytes; at most {} are taken", head.contentLength,
                          limits.mostBodyBytes);
        if (bodyBytes + head.contentLength > 4 * limits.mostBodyBytes)
            throw Refusal(503, "busy", "{} bytes of bodies are on their way; no more are taken", bodyBytes.load());
    } catch (const Refusal& refusal) {
        refuse(connection, begun, refusal);
        return false;
    }
    bodyBytes += head.contentLength;
    const bool staysOpen = exchange->serve(connection, begun.id, head, ends);
    bodyBytes -= head.contentLength;
    return staysOpen;
}

HttpServer::HttpServer(std::vector<Listener> listeners, const HttpLimits& limits, Admission admission, Handler handler,
                       Note note)
    : impl_(std::make_unique<Impl>())
{
    Impl& m = *impl_;
    m.limits = limits;
    m.admission = std::move(admission);
    m.note = note;
    m.listeners = std::move(listeners);
    m.exchange = std::make_unique<HttpExchange>(limits, std::move(handler), std::move(note));
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
