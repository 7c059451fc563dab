#include "server/Connection.h"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>

namespace virga::server {

using Clock = std::chrono::steady_clock;

bool hasHungUp(int socket) noexcept
{
    pollfd watched{socket, POLLRDHUP, 0};
    return poll(&watched, 1, 0) > 0 && (watched.revents & (POLLRDHUP | POLLHUP | POLLERR | POLLNVAL)) != 0;
}

PacedTransfer::PacedTransfer(Connection& connection, const Pace& pace)
    : connection_(connection), pace_(pace), start_(Clock::now())
{
}

template <class Move>
ssize_t PacedTransfer::moved(short event, const Move& move)
{
    while (true) {
        const ssize_t count = move();
        if (count >= 0) {
            bytes_ += std::size_t(count);
            return count;
        }
        if (errno == EINTR) continue;
        if (errno != EAGAIN && errno != EWOULDBLOCK) return -1;
        const auto earned = std::chrono::duration_cast<std::chrono::milliseconds>(
            std::chrono::duration<double>(double(bytes_) / pace_.leastBytesPerSecond));
        const auto left =
            std::chrono::duration_cast<std::chrono::milliseconds>(start_ + pace_.slack + earned - Clock::now());
        if (left.count() <= 0) return -1;
        pollfd watched{socket(), event, 0};
        poll(&watched, 1, int(std::min<long>(left.count(), 1000)));
    }
}

ssize_t PacedTransfer::read(char* to, std::size_t size)
{
    if (used_ < connection_.pending.size()) {
        const std::size_t count = std::min(size, connection_.pending.size() - used_);
        std::copy_n(connection_.pending.data() + used_, count, to);
        used_ += count;
        return ssize_t(count);
    }
    return moved(POLLIN, [&] { return recv(socket(), to, size, MSG_DONTWAIT); });
}

ssize_t PacedTransfer::write(const char* from, std::size_t size)
{
    if (!isWriting_) {  // rendering took what it took
        isWriting_ = true;
        start_ = Clock::now();
        bytes_ = 0;
    }
    return moved(POLLOUT, [&] { return send(socket(), from, size, MSG_DONTWAIT | MSG_NOSIGNAL); });
}

void PacedTransfer::settle()
{
    connection_.pending.erase(0, used_);
    used_ = 0;
}

}  // namespace virga::server
