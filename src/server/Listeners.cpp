#include "server/Listeners.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <utility>

#include "core/Error.h"

namespace virga::server {

Descriptor::~Descriptor()
{
    if (number_ >= 0) close(number_);
}

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept
{
    if (this != &other) {
        if (number_ >= 0) close(number_);
        number_ = other.release();
    }
    return *this;
}

int Descriptor::release() noexcept { return std::exchange(number_, -1); }

UnixListener::UnixListener(const std::string& path) : path_(path)
{
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.size() >= sizeof address.sun_path)
        throw Error(ErrorCode::Output, "--socket '{}': has {} bytes; a socket's name has at most {}", path, path.size(),
                    sizeof address.sun_path - 1);
    std::memcpy(address.sun_path, path.c_str(), path.size());
    const auto failed = [&](const char* what) {
        return Error(ErrorCode::Output, "--socket '{}': {} ({})", path, what, std::strerror(errno));
    };
    lock_ = Descriptor(open((path + ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (lock_.get() < 0) throw failed("cannot be made");
    if (flock(lock_.get(), LOCK_EX | LOCK_NB) != 0)
        throw Error(ErrorCode::Output, "--socket '{}': another server listens there", path);
    struct stat status {};
    if (lstat(path.c_str(), &status) == 0) {
        if (!S_ISSOCK(status.st_mode))
            throw Error(ErrorCode::Output, "--socket '{}': is there already and no socket", path);
        unlink(path.c_str());  // nobody listens: we have the lock
    }
    socket_ = Descriptor(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    // Permissions before there is a name: between bind and chmod others could connect.
    if (socket_.get() < 0 || fchmod(socket_.get(), 0600) != 0) throw failed("cannot be made");
    const mode_t mask = umask(0177);
    const bool isBound = bind(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    umask(mask);
    if (!isBound || listen(socket_.get(), SOMAXCONN) != 0) throw failed("cannot be listened on");
}

UnixListener::~UnixListener()
{
    unlink(path_.c_str());
    // The lock's file stays: removing it could take it from a server that has just opened it.
}

bool TcpAddress::isLoopback() const { return host.starts_with("127.") || host == "::1"; }

TcpAddress parseTcpAddress(const std::string& text)
{
    TcpAddress address{"127.0.0.1", 0};
    std::string port = text;
    if (const std::size_t colon = text.rfind(':'); colon != std::string::npos) {
        address.host = text.substr(0, colon);
        port = text.substr(colon + 1);
        if (address.host.starts_with('[') && address.host.ends_with(']'))
            address.host = address.host.substr(1, address.host.size() - 2);
    }
    const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), address.port);
    in_addr four{};
    in6_addr six{};
    const bool isHost =
        inet_pton(AF_INET, address.host.c_str(), &four) == 1 || inet_pton(AF_INET6, address.host.c_str(), &six) == 1;
    if (error != std::errc() || end != port.data() + port.size() || port.empty() || address.port < 0 ||
        address.port > 65535 || !isHost)
        throw Error(ErrorCode::InvalidArgument,
                    "--listen '{}': must be an address and a port, 127.0.0.1:8717 or [::1]:8717, or a port", text);
    return address;
}

Descriptor listenTcp(const TcpAddress& address, int& port)
{
    sockaddr_in four{};
    sockaddr_in6 six{};
    const bool isSix = address.host.find(':') != std::string::npos;
    four.sin_family = AF_INET;
    six.sin6_family = AF_INET6;
    four.sin_port = six.sin6_port = htons(std::uint16_t(address.port));
    inet_pton(isSix ? AF_INET6 : AF_INET, address.host.c_str(),
              isSix ? static_cast<void*>(&six.sin6_addr) : static_cast<void*>(&four.sin_addr));
    auto* const name = isSix ? reinterpret_cast<sockaddr*>(&six) : reinterpret_cast<sockaddr*>(&four);
    socklen_t size = isSix ? sizeof six : sizeof four;
    Descriptor made(socket(isSix ? AF_INET6 : AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    const int yes = 1;
    if (made.get() < 0 || setsockopt(made.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0 ||
        bind(made.get(), name, size) != 0 || listen(made.get(), SOMAXCONN) != 0 ||
        getsockname(made.get(), name, &size) != 0)
        throw Error(ErrorCode::Output, "--listen {}:{}: cannot be listened on ({})", address.host, address.port,
                    std::strerror(errno));
    port = ntohs(isSix ? six.sin6_port : four.sin_port);
    return made;
}

}  // namespace virga::server
