#include "server/PlateShelf.h"

#include <algorithm>
#include <future>
#include <utility>

#include "core/Error.h"

namespace virga::server {

PlateShelf::PlateShelf(const std::string& path, const io::ReadOptions& options, std::size_t mostBytes)
    : onError_(options.onError), kept_(mostBytes), thread_([this] { serve(); })
{
    try {
        run([&] {
            reader_ = io::openPlate(path, options);
            reader_->fitChroma({});  // as for images
            info_ = reader_->info();
        });
    } catch (...) {
        {
            const std::lock_guard lock(mutex_);
            ends_ = true;
        }
        changed_.notify_all();
        thread_.join();
        throw;
    }
}

PlateShelf::~PlateShelf()
{
    {
        const std::lock_guard lock(mutex_);
        ends_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

void PlateShelf::run(const std::function<void()>& work)
{
    std::packaged_task<void()> task(work);
    {
        const std::lock_guard lock(mutex_);
        jobs_.emplace_back([&task] { task(); });
    }
    changed_.notify_all();
    task.get_future().get();
}

void PlateShelf::serve()
{
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [&] { return ends_ || !jobs_.empty(); });
        if (jobs_.empty()) break;
        const std::function<void()> job = std::move(jobs_.front());
        jobs_.pop_front();
        lock.unlock();
        job();
        lock.lock();
    }
    lock.unlock();
    reader_.reset();  // on the thread that it belongs to
}

FrameNumber PlateShelf::standIn(FrameNumber frame) const
{
    if (info_.isStill) return info_.frames.front();
    if (onError_ == io::OnError::Stop && !std::binary_search(info_.frames.begin(), info_.frames.end(), frame))
        throw Error(ErrorCode::InvalidArgument, "frame {}: the plate has {}", frame, formatFrameRange(info_.frames));
    return frame;
}

std::shared_ptr<const io::PlateFrame> PlateShelf::read(FrameNumber frame, const std::string& stamp)
{
    const std::string key = std::to_string(frame) + "|" + stamp;
    if (auto kept = kept_.find(key)) return kept;
    std::shared_ptr<const io::PlateFrame> result;
    run([&] {
        if ((result = kept_.find(key))) return;  // somebody else asked for it meanwhile
        std::optional<io::PlateFrame> read = reader_->read(frame);
        if (!read) return;
        result = std::make_shared<const io::PlateFrame>(std::move(*read));
        kept_.keep(key, result, result->pixels.size() * sizeof(float));
    });
    return result;
}

shot::PlateSamples PlateShelf::samples(const shot::Settings& settings, bool light, bool standsStill)
{
    shot::PlateSamples result;
    run([&] { result = shot::samplePlate(*reader_, settings, light, standsStill); });
    return result;
}

}  // namespace virga::server
