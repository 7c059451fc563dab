// A session's compositors, on the thread of the render queue: one for frames with layers, one for those without.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "server/FrameAnswer.h"
#include "server/FrameQuery.h"
#include "shot/Compositor.h"

namespace virga::server {

/// What a compositor is made from besides its settings. A new key: another compositor; the same one: it may change.
struct RenderInputs {
    std::string key;
    shot::Shot shot;
    shot::PlateSamples samples;
};

/// Of the server: what renders, and since when something else than was asked for. Thread-safe.
class RenderDevice {
public:
    explicit RenderDevice(std::string wanted) : wanted_(std::move(wanted)) {}
    std::string wanted() const;
    std::string used() const;      ///< as last heard of a compositor; empty before the first
    std::string fallback() const;  ///< why the processor renders now though it was not asked for; empty: it does not
    void note(const std::string& used);
    void fallBack(const std::string& why);

private:
    mutable std::mutex mutex_;
    std::string wanted_, used_, fallback_;
};

struct RenderTask {
    shot::Settings settings;  ///< paths resolved
    std::string settingsKey;  ///< all of the above as text
    std::shared_ptr<const RenderInputs> inputs;
    std::shared_ptr<const io::PlateFrame> plate;
    FrameQuery query;
};

/// All but the constructor: on the queue's thread.
class SessionRenderer {
public:
    SessionRenderer(RenderDevice& device, std::string cacheFolder);
    /// passMs gets what the passes of this frame took. Where the device fails the processor takes over, which is said.
    /// Throws Error.
    Picture render(const RenderTask& task, const Watch& watch, std::map<std::string, double>& passMs);

private:
    struct Slot {
        std::string inputsKey, settingsKey;
        std::unique_ptr<shot::Compositor> compositor;
    };
    shot::Compositor& compositorFor(const RenderTask& task, bool layers);
    Picture renderOnce(const RenderTask& task, const Watch& watch, std::map<std::string, double>& passMs);

    RenderDevice& device_;
    const std::string cacheFolder_;
    std::array<Slot, 2> slots_;  // without layers, with them
};

}  // namespace virga::server
