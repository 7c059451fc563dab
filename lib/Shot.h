// A shot of the C interface: settings, and a compositor for them on the thread that renders for all.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "Colors.h"
#include "Errors.h"
#include "FrameRequest.h"
#include "shot/Compositor.h"
#include "shot/RenderQueue.h"
#include "virga/virga.h"

namespace virga::lib {

/// Any thread may call; calls take turns, but for cancel(). All throw Error.
class Shot {
public:
    /// Throws Error(InvalidArgument) for sizes and rates that virga_shot_create refuses.
    Shot(int width, int height, double fps);
    /// Once nobody calls any more. Waits for the compositor's end.
    ~Shot();

    FailureOfShot& failure() { return failure_; }

    /// `set` throws: the settings stay.
    void change(const std::function<void(shot::Settings&)>& set);
    shot::Settings settings() const;
    void setDevice(const std::string& device);
    /// See virga_shot_device.
    std::string device() const;
    /// Of a text that the caller may look at until the next one of its kind.
    enum class Text { Value, Document, Device };
    const char* keep(Text kind, std::string text);

    void addSample(FrameNumber frame, const virga_picture* plate);
    void clearSamples();
    std::vector<FrameNumber> samplesWanted(FrameNumber first, FrameNumber last) const;
    void setEnvironment(const virga_picture* panorama);  // may be null

    bool isIdentity() const;
    Window frameAt(double scale) const;
    Window plateNeeded(const virga_request* given);
    void render(const virga_request* given);
    void cancel() noexcept;

private:
    /// A render that has been called and has not returned.
    struct Call {
        std::atomic<bool> isCancelled = false;
        std::optional<shot::RenderQueue::Ticket> ticket;  // callsMutex_
    };
    class CallSpan;
    /// A frame of the plate that stands for others.
    struct Sample {
        ImageF forLight, whole;  // the latter only for a grade
    };
    /// What a compositor is made for. Settings, depth and panorama can be changed, all else needs another one.
    struct Made {
        std::uint64_t settings = 0, samples = 0;
        std::vector<FrameNumber> lit{}, graded{};  // samples
        bool hasDepth = false, hasLayers = false;
        std::string device, panorama;
        double fps = 0;
        FrameNumber firstFrame = 0;
        bool operator==(const Made&) const = default;
    };

    shot::Settings settingsFor(const Made& made) const;
    std::vector<FrameNumber> chosenSamples(const std::set<std::size_t>& places, FrameNumber first) const;
    void chooseSamples(Made& made) const;
    shot::PlateSamples plateSamples(const Made& made) const;
    Made wanted(const FrameRequest& request) const;
    void takeDepth(const FrameRequest& request);

    /// On the queue's thread.
    void open(const Made& made);
    void makeReady(const Made& made);
    void withFallback(const FrameRequest& request, const std::function<void()>& work);

    /// Runs it on the queue's thread and waits. Throws Error(Interrupted) if the call is cancelled before it begins.
    void onQueue(Call& call, int priority, const std::function<void()>& work);
    /// Sees to it that there is a compositor for the request.
    void prepare(const FrameRequest& request, Call& call);
    Window neededPlate(const FrameRequest& request) const;
    Window plateFor(const FrameRequest& request, const Window& needed) const;
    io::RenderedFrame draw(const FrameRequest& request, Call& call);
    void write(const FrameRequest& request, const io::RenderedFrame& rendered);
    void copyPlate(const FrameRequest& request);

    const int width_, height_;
    const double fps_;
    const std::shared_ptr<shot::RenderQueue> queue_ = shot::RenderQueue::ofProcess();
    FailureOfShot failure_;

    mutable std::mutex turn_;  // all below but the calls
    shot::Settings settings_;
    std::uint64_t settingsCount_ = 1, samplesCount_ = 1;  // of changes
    std::string device_ = "auto", fallback_;              // fallback_: why the processor stands in; empty: it does not
    std::map<FrameNumber, Sample> samples_;
    std::string panorama_;  // for Settings::env; empty: none in memory
    const std::shared_ptr<shot::PicturesInMemory> inMemory_ = std::make_shared<shot::PicturesInMemory>();
    Colors colors_;
    std::map<Text, std::string> texts_;
    std::unique_ptr<shot::Compositor> compositor_;  // made and destroyed on the queue's thread
    Made made_;

    std::mutex callsMutex_;
    std::list<std::shared_ptr<Call>> calls_;
};

}  // namespace virga::lib
