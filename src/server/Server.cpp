#include "server/Server.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>

#include "core/Error.h"
#include "core/Log.h"
#include "server/Engine.h"
#include "server/Refusal.h"
#include "server/Routes.h"

namespace virga::server {
namespace {

/// A descriptor for each connection, and some.
void raiseDescriptorLimit(std::size_t connections)
{
    rlimit limit{};
    if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= connections + 512) return;
    limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, connections + 512);
    setrlimit(RLIMIT_NOFILE, &limit);
}

std::shared_ptr<Session> openFirst(Engine& engine, const ServeOptions& options)
{
    SessionDocument document;
    document.platePath = options.plate;
    document.settings = options.settings;
    try {
        return engine.open(document);
    } catch (const Refusal& refusal) {
        throw Error(ErrorCode::Input, "{}", refusal.what());
    }
}

}  // namespace

void serve(const ServeOptions& options, const std::function<void(const Serving&)>& ready,
           const std::function<bool()>& ends)
{
    if (options.address && !options.address->isLoopback() && !options.isPublic)
        throw Error(ErrorCode::InvalidArgument,
                    "--listen {}: other machines reach that address; --public says that it is meant",
                    options.address->host);
    sweepSharedMemory();
    raiseDescriptorLimit(options.http.mostConnections);
    std::optional<UnixListener> local;
    Descriptor tcp;
    Serving serving;
    std::vector<Listener> listeners;
    if (!options.socket.empty()) {
        local.emplace(options.socket);
        listeners.push_back({local->get(), false});
    }
    if (options.address) {
        tcp = listenTcp(*options.address, serving.port);
        listeners.push_back({tcp.get(), true});
        const std::string& host = options.address->host;
        serving.url =
            fmt::format("http://{}:{}/#token={}", host.find(':') != std::string::npos ? "[" + host + "]" : host,
                        serving.port, options.token);
    }
    if (listeners.empty())
        throw Error(ErrorCode::InvalidArgument, "there is nothing to listen on: --socket or --listen");

    Engine engine(options.root, options.device, options.cacheFolder, options.engine);
    if (!options.plate.empty()) openFirst(engine, options);
    Routes routes(engine);
    // Whoever waits for a frame holds a thread; some are left for who asks how it goes.
    HttpLimits limits = options.http;
    limits.mostThreads = std::max(limits.mostThreads, options.engine.queue + 32);
    HttpServer http(
        listeners, limits, {options.token, options.isPublic},
        [&](const HttpRequest& request) { return routes.answer(request); },
        [&](const HttpRequest& request, int status, double ms, std::size_t bytes) {
            engine.services().metrics.countRequest(Routes::kindOf(request.path), status, 1e-3 * ms);
            log::writeFields(log::Level::Verbose,
                             fmt::format("{} {}: {} in {:.1f} ms, {} bytes", request.method,
                                         shortened(request.path, 200), status, ms, bytes),
                             {{"request", std::to_string(request.id)},
                              {"method", request.method},
                              {"path", shortened(request.path, 200)},
                              {"status", std::to_string(status)},
                              {"ms", fmt::format("{:.2f}", ms)},
                              {"bytes", std::to_string(bytes)}});
        });
    routes.connections = [&] { return http.connections(); };
    ready(serving);
    http.run(ends, [&] { engine.sweep(); });
    log::info("finishing what runs");
}

}  // namespace virga::server
