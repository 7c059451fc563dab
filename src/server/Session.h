// One shot that a client works on: its plate, its settings, and the frames of it that are asked for.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "server/FrameAnswer.h"
#include "server/LruCache.h"
#include "server/Metrics.h"
#include "server/PlateShelf.h"
#include "server/ServedFolder.h"
#include "server/SessionDocument.h"
#include "server/SessionRenderer.h"
#include "server/SharedMemory.h"
#include "shot/RenderQueue.h"

namespace virga::server {

struct EngineLimits {
    std::size_t sessions = 16;
    double megapixels = 40;                           ///< of a frame
    std::size_t queue = 64;                           ///< frames that wait to be rendered
    std::size_t cacheBytes = std::size_t(512) << 20;  ///< pictures and answers, half each; a session's plates a quarter
    std::size_t plateBytes = std::size_t(1) << 30;    ///< plates that a client posts, of one session
    std::size_t sharedBytes = std::size_t(256) << 20;  ///< shared memory handed out
    std::chrono::seconds idle{1800};                   ///< after which a session is closed
    int prefetch = 2;                                  ///< neighbours of a viewer's frame
};

/// What the sessions share. Outlives them.
struct Services {
    Services(const std::string& root, const std::string& device, std::string cacheFolder, const EngineLimits& limits);

    const EngineLimits limits;
    const ServedFolder folder;
    const std::string cacheFolder;
    RenderDevice device;
    Metrics metrics;
    LruCache<Picture> pictures;
    LruCache<std::string> bodies;
    SharedShelf shared;
    std::shared_ptr<shot::RenderQueue> queue;
};

struct FrameAnswer {
    std::string etag;                         ///< with its quotes
    bool isUnchanged = false;                 ///< the client has it
    std::shared_ptr<const std::string> body;  ///< else; null if the answer is shared memory
    std::string sharedName;
    std::size_t sharedBytes = 0;
    Window data;
    const char* cache = "miss";  ///< "unchanged", "body", "picture", "miss"
    double render_ms = 0;
};

/// Thread-safe.
class Session : public std::enable_shared_from_this<Session> {
public:
    using IsGone = std::function<bool()>;

    /// Opens the plate. Throws Refusal, Error.
    Session(std::string id, const SessionDocument& document, Services& services);
    ~Session();

    const std::string& id() const { return id_; }
    nlohmann::json describe();
    nlohmann::json summary() const;   ///< without opening anything
    shot::Settings settings() const;  ///< as the client gave them
    /// All or nothing. Throws Refusal, Error.
    void change(std::string_view json);
    /// A frame of the client's own. type: an image's, or application/x-virga-raw. Throws Refusal, Error.
    void putPlate(FrameNumber frame, std::string_view type, std::string_view body);

    /// Waits for it. Throws Refusal: 409 if a newer request of the same viewer overtakes it or its client is gone,
    /// 503 if too many wait already; Error.
    FrameAnswer frame(const FrameQuery& query, Format format, std::string_view ifNoneMatch, const IsGone& isGone);
    /// The plate's own frame, untouched.
    FrameAnswer plate(const FrameQuery& query, Format format, std::string_view ifNoneMatch);
    /// Renders a frame that nobody asked for, unless somebody else waits.
    void prefetch(const FrameQuery& query);

    bool isIdle() const;

private:
    struct Flight;
    struct Prepared {
        RenderTask task;
        std::shared_ptr<PlateShelf> shelf;
        FrameNumber plateFrame = 0;
        std::string plateStamp;  // of its file
        std::string pictureKey;  // all that the picture depends on
    };
    /// Keeps the session from being idle.
    class Use {
    public:
        explicit Use(Session& session) : session_(session) { session_.count(1); }
        ~Use() { session_.count(-1); }
        Use(const Use&) = delete;
        Use& operator=(const Use&) = delete;

    private:
        Session& session_;
    };
    void count(int requests);
    std::string plateName() const;
    std::shared_ptr<PlateShelf> shelfFor(const shot::Settings& settings, const std::string& plate);
    std::shared_ptr<const RenderInputs> inputsFor(const shot::Settings& settings, const std::string& fileStamps,
                                                  bool layers);
    Prepared prepare(const FrameQuery& query);
    std::shared_ptr<const Picture> pictureOf(Prepared& prepared, const std::shared_ptr<Flight>& flight,
                                             const IsGone& isGone, FrameAnswer& answer);
    std::shared_ptr<Flight> takeOff(const std::string& viewer);
    void encode(const Picture& picture, const Prepared& prepared, Format format, FrameAnswer& answer);
    void checkPixels(int width, int height, double scale) const;

    const std::string id_;
    Services& services_;
    std::string plateName_;  // as the client gave it; empty: posted
    std::optional<PostedShot> posted_;
    std::unique_ptr<ScratchFolder> scratch_;  // of posted plates
    std::string postedEnding_;

    std::mutex changeMutex_;  // of changes: one after the other
    mutable std::mutex mutex_;
    shot::Settings settings_;
    std::chrono::steady_clock::time_point lastUsed_;
    int busy_ = 0;  // requests under way
    std::map<std::string, std::weak_ptr<Flight>> viewers_;
    std::map<FrameNumber, std::size_t> postedBytes_;

    std::mutex inputsMutex_;  // of what is read: one at a time
    std::string shelfKey_;
    std::shared_ptr<PlateShelf> shelf_;
    std::shared_ptr<const RenderInputs> inputs_[2];  // without layers, with them

    std::unique_ptr<SessionRenderer> renderer_;  // used and destroyed on the queue's thread
};

}  // namespace virga::server
