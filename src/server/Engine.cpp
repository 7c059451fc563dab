#include "server/Engine.h"

#include <fmt/format.h>
#include <sys/random.h>

#include <algorithm>
#include <cmath>

#include "core/Error.h"
#include "core/Log.h"
#include "server/Refusal.h"

namespace virga::server {

std::string randomName()
{
    unsigned char bytes[16];
    if (getrandom(bytes, sizeof bytes, 0) != sizeof bytes)
        throw Error(ErrorCode::Internal, "the system has no random numbers");
    std::string name;
    for (const unsigned char byte : bytes) name += fmt::format("{:02x}", byte);
    return name;
}

Engine::Engine(const std::string& root, const std::string& device, std::string cacheFolder, const EngineLimits& limits)
    : services_(root, device, std::move(cacheFolder), limits), prefetcher_([this] { prefetch(); })
{
    services_.queue->submit(0, [this](const shot::RenderQueue::Ticket&) { warmUp(); });
}

Engine::~Engine()
{
    {
        const std::lock_guard lock(aheadMutex_);
        ends_ = true;
    }
    aheadChanged_.notify_all();
    prefetcher_.join();
    sessions_.clear();
    services_.queue->run([this] { warm_.reset(); });
}

/// Opens the device and compiles its programs before somebody waits for a frame.
void Engine::warmUp()
try {
    shot::CompositorOptions options;
    options.device = services_.device.wanted();
    options.cacheFolder = services_.cacheFolder;
    warm_ =
        std::make_unique<shot::Compositor>(shot::Settings(), shot::Shot{64, 36, 24, 0}, options, shot::PlateSamples());
    io::PlateFrame plate;
    plate.pixels = ImageF(64, 36, 4, 0.5f);
    warm_->render(std::move(plate));
    services_.device.note(warm_->statistics().device);
} catch (const Error& error) {
    if (error.code() == ErrorCode::Graphics && services_.device.wanted() != "cpu")
        services_.device.fallBack(error.what());
    else
        log::warning("{}", error.what());
}

std::shared_ptr<Session> Engine::open(const SessionDocument& document)
{
    const auto full = [&] {
        const std::lock_guard lock(mutex_);
        return sessions_.size() >= services_.limits.sessions;
    };
    if (full()) {
        sweep();
        if (full())
            throw Refusal(503, "too-many-sessions", "there are {} sessions, as many as may be; close one",
                          services_.limits.sessions);
    }
    auto session = std::make_shared<Session>(randomName(), document, services_);
    const std::lock_guard lock(mutex_);
    sessions_[session->id()] = session;
    return session;
}

std::shared_ptr<Session> Engine::find(const std::string& id) const
{
    const std::lock_guard lock(mutex_);
    const auto found = sessions_.find(id);
    if (found == sessions_.end()) throw Refusal(404, "no-session", "there is no session '{}'", shortened(id));
    return found->second;
}

void Engine::close(const std::string& id)
{
    const std::shared_ptr<Session> session = find(id);
    const std::lock_guard lock(mutex_);
    sessions_.erase(id);
}

std::vector<std::shared_ptr<Session>> Engine::all() const
{
    const std::lock_guard lock(mutex_);
    std::vector<std::shared_ptr<Session>> sessions;
    for (const auto& [id, session] : sessions_) sessions.push_back(session);
    return sessions;
}

void Engine::sweep()
{
    std::vector<std::shared_ptr<Session>> idle;
    {
        const std::lock_guard lock(mutex_);
        for (auto at = sessions_.begin(); at != sessions_.end();) {
            if (!at->second->isIdle()) {
                ++at;
                continue;
            }
            idle.push_back(std::move(at->second));
            at = sessions_.erase(at);
        }
    }
    for (std::shared_ptr<Session>& session : idle) {
        log::info("session {} was idle and is closed", session->id());
        // Ends on the queue's thread, so that nobody waits here for what is being rendered.
        services_.queue->submit(0, [last = std::move(session)](const shot::RenderQueue::Ticket&) {});
    }
    services_.shared.sweep();
}

void Engine::showed(const std::shared_ptr<Session>& session, const FrameQuery& query)
{
    if (services_.limits.prefetch <= 0 || query.viewer.empty() || query.time_s) return;
    {
        const std::lock_guard lock(aheadMutex_);
        ahead_.clear();  // what was around the frame before
        for (int i = 1; i <= services_.limits.prefetch; ++i) {
            FrameQuery neighbour = query;
            neighbour.frame += i == 2 ? -1 : i == 1 ? 1 : i - 1;  // +1, -1, +2, +3 ...
            ahead_.emplace_back(session, neighbour);
        }
    }
    aheadChanged_.notify_all();
}

void Engine::prefetch()
{
    std::unique_lock lock(aheadMutex_);
    while (true) {
        aheadChanged_.wait(lock, [&] { return ends_ || !ahead_.empty(); });
        if (ends_) return;
        const auto [weak, query] = ahead_.front();
        ahead_.pop_front();
        lock.unlock();
        try {
            if (const auto session = weak.lock()) session->prefetch(query);
        } catch (const std::exception&) {
            // Whoever asks for the frame is told.
        }
        lock.lock();
    }
}

}  // namespace virga::server
