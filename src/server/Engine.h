// The sessions of a server, and the frames that are rendered before anybody asks.
#pragma once

#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/Timer.h"
#include "server/Session.h"
#include "shot/Compositor.h"

namespace virga::server {

/// Thread-safe.
class Engine {
public:
    Engine(const std::string& root, const std::string& device, std::string cacheFolder, const EngineLimits& limits);
    /// Renders what runs to its end, and closes all sessions.
    ~Engine();
    Engine(const Engine&) = delete;
    Engine& operator=(const Engine&) = delete;

    Services& services() { return services_; }
    double uptime_s() const { return clock_.seconds(); }

    /// Throws Refusal 503 where there are as many as the limit says, and what Session does.
    std::shared_ptr<Session> open(const SessionDocument& document);
    std::shared_ptr<Session> find(const std::string& id) const;  ///< throws Refusal 404
    void close(const std::string& id);                           ///< throws Refusal 404
    std::vector<std::shared_ptr<Session>> all() const;
    /// Closes idle sessions and takes back shared memory whose time is over.
    void sweep();

    /// Renders the neighbours of a frame that a viewer was shown, when nobody waits.
    void showed(const std::shared_ptr<Session>& session, const FrameQuery& query);

private:
    void warmUp();
    void prefetch();

    const Timer clock_;
    Services services_;
    mutable std::mutex mutex_;
    std::map<std::string, std::shared_ptr<Session>> sessions_;

    std::mutex aheadMutex_;
    std::condition_variable aheadChanged_;
    std::deque<std::pair<std::weak_ptr<Session>, FrameQuery>> ahead_;
    bool ends_ = false;
    std::unique_ptr<shot::Compositor> warm_;  // the queue's thread's: keeps the device open between sessions
    std::thread prefetcher_;                  // last: it starts when all of the above stands
};

/// 32 random hex digits, from the kernel.
std::string randomName();

}  // namespace virga::server
