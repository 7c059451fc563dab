// Sockets that wait for clients.
#pragma once

#include <string>

namespace virga::server {

/// A descriptor that is closed with its owner; -1: none.
class Descriptor {
public:
    explicit Descriptor(int number = -1) noexcept : number_(number) {}
    ~Descriptor();
    Descriptor(Descriptor&& other) noexcept : number_(other.release()) {}
    Descriptor& operator=(Descriptor&& other) noexcept;
    int get() const noexcept { return number_; }
    int release() noexcept;

private:
    int number_;
};

/// A Unix socket that only this user may open (0600), removed with this object. What a dead server left under the name
/// is replaced; a living one is told by the lock on NAME.lock, which ends with its process however that ends.
class UnixListener {
public:
    /// Throws Error(Output): a living server has the name, something that is no socket has it, the folder is missing,
    /// the name is too long for a socket (107 bytes).
    explicit UnixListener(const std::string& path);
    ~UnixListener();
    UnixListener(const UnixListener&) = delete;
    UnixListener& operator=(const UnixListener&) = delete;
    int get() const noexcept { return socket_.get(); }

private:
    std::string path_;
    Descriptor lock_, socket_;
};

struct TcpAddress {
    std::string host;  ///< an address, not a name: "127.0.0.1", "::1"
    int port = 0;      ///< 0: any that is free
    bool isLoopback() const;
};

/// "127.0.0.1:8717", "[::1]:8717", "8717" (on 127.0.0.1). Throws Error(InvalidArgument).
TcpAddress parseTcpAddress(const std::string& text);
/// port gets the number that was taken. Throws Error(Output).
Descriptor listenTcp(const TcpAddress& address, int& port);

}  // namespace virga::server
