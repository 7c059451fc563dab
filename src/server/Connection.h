// A client's connection: what has been read of it, and reading and writing it at a least speed.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <string>

#include "server/Listeners.h"

namespace virga::server {

struct Connection {
    Descriptor socket;
    bool isTcp = false;
    std::string pending;                             ///< read and not used: a head, what follows it
    std::chrono::steady_clock::time_point deadline;  ///< of the head, or of being idle
};

/// Whether the client has closed its side. (One that only says that it will send no more counts as gone too.)
bool hasHungUp(int socket) noexcept;

struct Pace {
    std::chrono::seconds slack{10};
    double leastBytesPerSecond = 262144;  ///< after `slack`
};

/// A body on its way in, then an answer on its way out. What comes or goes too slowly ends as if the client had hung
/// up.
class PacedTransfer {
public:
    PacedTransfer(Connection& connection, const Pace& pace);
    /// As recv(2) and send(2), but they wait: bytes moved, 0 at the end, -1 if it is over.
    ssize_t read(char* to, std::size_t size);
    ssize_t write(const char* from, std::size_t size);
    int socket() const noexcept { return connection_.socket.get(); }
    /// Takes what was read off the connection's pending bytes.
    void settle();

private:
    template <class Move>
    ssize_t moved(short event, const Move& move);

    Connection& connection_;
    const Pace pace_;
    std::chrono::steady_clock::time_point start_;
    std::size_t used_ = 0, bytes_ = 0;
    bool isWriting_ = false;
};

}  // namespace virga::server
