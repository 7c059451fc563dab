// A plate's frames in any order. One thread of its own reads them, so that a frame is decoded while another is
// rendered; what was read lately is kept.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "io/Plate.h"
#include "server/LruCache.h"
#include "shot/PlateSamples.h"

namespace virga::server {

/// Thread-safe. A frame is the one that `virga rain` gets for an image: chroma interpolated, light.
class PlateShelf {
public:
    /// Throws Error(Input) as io::openPlate.
    PlateShelf(const std::string& path, const io::ReadOptions& options, std::size_t mostBytes);
    /// Ends what is being read.
    ~PlateShelf();
    PlateShelf(const PlateShelf&) = delete;
    PlateShelf& operator=(const PlateShelf&) = delete;

    const io::PlateInfo& info() const { return info_; }
    /// The frame of the plate that stands for `frame`: the only one of a still. Throws Error(InvalidArgument) naming
    /// those that there are.
    FrameNumber standIn(FrameNumber frame) const;

    /// Waits for it. stamp: what its file was when it was asked for (ServedFolder::stampOf); another one is read anew.
    /// Throws Error(Input); null if it is damaged and the settings leave such frames out.
    std::shared_ptr<const io::PlateFrame> read(FrameNumber frame, const std::string& stamp);

    /// See shot::samplePlate.
    shot::PlateSamples samples(const shot::Settings& settings, bool light, bool standsStill);

private:
    void run(const std::function<void()>& work);  // on the thread; waits; rethrows
    void serve();

    io::OnError onError_;
    std::unique_ptr<io::PlateReader> reader_;  // the thread's
    io::PlateInfo info_;
    LruCache<io::PlateFrame> kept_;

    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<std::function<void()>> jobs_;
    bool ends_ = false;
    std::thread thread_;  // last: it starts when all of the above stands
};

}  // namespace virga::server
