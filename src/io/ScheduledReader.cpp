// Reading ahead: threads load the frames of the schedule a few ahead of the one that was asked for last.

#include <algorithm>
#include <condition_variable>
#include <exception>
#include <map>
#include <mutex>
#include <thread>

#include "core/Error.h"
#include "core/Log.h"
#include "io/FrameSource.h"

namespace virga::io {

namespace {

struct Loaded {
    std::optional<PlateFrame> frame;
    std::exception_ptr problem;
};

class ScheduledReader final : public SourcedReader {
public:
    ScheduledReader(std::unique_ptr<FrameSource> source, const ReadOptions& options)
        : source_(std::move(source)), onError_(options.onError), timeline_(options.timeline),
          ahead_(framesReadAhead(source_->info()))
    {
    }

    ~ScheduledReader() override { stopThreads(); }

    const PlateInfo& info() const override { return source_->info(); }
    const FrameSource& source() const override { return *source_; }

    void fitChroma(SharedChroma result) override { source_->fitChroma(result); }

    void schedule(const std::vector<FrameNumber>& frames, Pixels pixels) override
    {
        stopThreads();
        schedule_ = frames;
        pixels_ = pixels;
        next_ = claimed_ = 0;
        loaded_.clear();
        stopping_ = false;
        still_.reset();
        if (info().isStill) return;  // one frame, whatever its numbers
        const int threads = std::min<int>(source_->parallelLoads(), int(frames.size()));
        for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { loadAhead(); });
    }

    std::optional<PlateFrame> read(FrameNumber number) override
    {
        if (still_) return *still_;
        Loaded result = take(number);
        if (!result.problem && info().isStill && schedule_.size() > 1) {  // one image for all: decoded once
            still_ = std::move(result.frame);
            still_->content = 1;
            return *still_;
        }
        if (!result.problem) return std::move(result.frame);
        if (onError_ == OnError::Stop) std::rethrow_exception(result.problem);
        try {
            std::rethrow_exception(result.problem);
        } catch (const Error& error) {
            if (error.code() != ErrorCode::Input) throw;
            if (onError_ == OnError::Skip) {
                log::warning("frame {} is left out: {}", number, error.what());
                return std::nullopt;
            }
            return hold(number, error);
        }
    }

private:
    void stopThreads()
    {
        {
            const std::lock_guard lock(mutex_);
            stopping_ = true;
        }
        changed_.notify_all();
        for (std::thread& thread : threads_) thread.join();
        threads_.clear();
    }

    Loaded loadNow(FrameNumber number)
    {
        const StageSpan span(timeline_, "reader", "read", number);
        Loaded result;
        try {
            if (source_->parallelLoads() > 1) {
                result.frame = source_->load(number, pixels_);
            } else {
                const std::lock_guard oneAtATime(sourceMutex_);
                result.frame = source_->load(number, pixels_);
            }
        } catch (...) {
            result.problem = std::current_exception();
        }
        return result;
    }

    void loadAhead()
    {
        std::unique_lock lock(mutex_);
        for (;;) {
            changed_.wait(lock, [&] { return stopping_ || claimed_ >= schedule_.size() || claimed_ < next_ + ahead_; });
            if (stopping_ || claimed_ >= schedule_.size()) return;
            const std::size_t index = claimed_++;
            lock.unlock();
            Loaded result = loadNow(schedule_[index]);
            lock.lock();
            if (index >= next_) loaded_[index] = std::move(result);
            changed_.notify_all();
        }
    }

    /// From what is loaded ahead if the schedule has the frame from here on, else loaded on the spot.
    Loaded take(FrameNumber number)
    {
        std::unique_lock lock(mutex_);
        const auto wanted = std::find(schedule_.begin() + std::ptrdiff_t(next_), schedule_.end(), number);
        if (threads_.empty() || wanted == schedule_.end()) {
            lock.unlock();
            return loadNow(number);
        }
        const std::size_t index = std::size_t(wanted - schedule_.begin());
        // What was scheduled before it will not be asked for any more.
        next_ = index;
        claimed_ = std::max(claimed_, index);
        loaded_.erase(loaded_.begin(), loaded_.lower_bound(index));
        changed_.notify_all();
        changed_.wait(lock, [&] { return loaded_.contains(index); });
        Loaded result = std::move(loaded_.at(index));
        loaded_.erase(index);
        next_ = index + 1;
        changed_.notify_all();
        return result;
    }

    /// The nearest good frame before `number`, else after it; looked for anew each time, so that the answer does not
    /// depend on what was read before.
    PlateFrame hold(FrameNumber number, const Error& error)
    {
        const auto& frames = info().frames;
        const auto here = std::lower_bound(frames.begin(), frames.end(), number);
        const auto tryFrame = [&](FrameNumber candidate) {
            Loaded result = loadNow(candidate);
            if (result.frame) {
                result.frame->repaired = fmt::format("held from frame {}: {}", candidate, error.what());
                result.frame->number = number;
                log::warning("frame {} is {}", number, result.frame->repaired);
            }
            return std::move(result.frame);
        };
        for (auto before = here; before != frames.begin();)
            if (auto frame = tryFrame(*--before)) return std::move(*frame);
        for (auto after = here; after != frames.end(); ++after)
            if (*after != number)
                if (auto frame = tryFrame(*after)) return std::move(*frame);
        throw error;
    }

    std::unique_ptr<FrameSource> source_;
    OnError onError_;
    Timeline* timeline_;
    std::size_t ahead_;

    std::mutex sourceMutex_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::vector<std::thread> threads_;
    std::vector<FrameNumber> schedule_;
    Pixels pixels_ = Pixels::Light;
    std::size_t next_ = 0;     // index in the schedule of the frame that is asked for next
    std::size_t claimed_ = 0;  // index of the first frame that no thread has taken on
    std::map<std::size_t, Loaded> loaded_;
    bool stopping_ = false;
    std::optional<PlateFrame> still_;  // the plate's one frame, if it is wanted several times
};

}  // namespace

std::unique_ptr<SourcedReader> makeScheduledReader(std::unique_ptr<FrameSource> source, const ReadOptions& options)
{
    return std::make_unique<ScheduledReader>(std::move(source), options);
}

}  // namespace virga::io
