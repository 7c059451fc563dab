// `virga serve`, whole: sockets, sessions, the page.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "server/Http.h"
#include "server/Listeners.h"
#include "server/Session.h"

namespace virga::server {

struct ServeOptions {
    std::string root = ".";
    std::string socket;                 ///< of the Unix socket; empty: none
    std::optional<TcpAddress> address;  ///< nothing: no TCP
    bool isPublic = false;              ///< an address beyond loopback is meant
    std::string token;                  ///< for TCP; must not be empty where there is an address
    std::string plate;                  ///< a session that is there from the start; empty: none
    shot::Settings settings;            ///< its settings
    std::string device = "auto";
    std::string cacheFolder;
    EngineLimits engine;
    HttpLimits http;
};

/// What there is once the server listens.
struct Serving {
    std::string url;  ///< of the page, with the token behind '#'; empty without TCP
    int port = 0;
};

/// Serves until `ends`, then finishes what runs. ready is called once when clients may come. Throws Error where it
/// cannot begin: InvalidArgument for an address beyond loopback that is not meant, Output for sockets.
void serve(const ServeOptions& options, const std::function<void(const Serving&)>& ready,
           const std::function<bool()>& ends);

}  // namespace virga::server
