#include "shot/ExtractFootage.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include "core/Error.h"
#include "core/Parallel.h"
#include "core/Timer.h"
#include "shot/FrameChoice.h"

namespace virga::shot {
namespace {

template <class T>
void append(std::vector<T>& to, std::vector<T>&& from)
{
    std::move(from.begin(), from.end(), std::back_inserter(to));
}

template <class T>
void erase(std::vector<T>& from, std::size_t count)
{
    if (!from.empty()) from.erase(from.begin(), from.begin() + std::ptrdiff_t(count));
}

io::OnError onErrorOf(const std::string& word)
{
    if (word == "skip") return io::OnError::Skip;
    if (word == "hold") return io::OnError::Hold;
    return io::OnError::Stop;
}

/// What sums of squares of pixels can be made of.
bool isUsable(float value) { return std::abs(value) < 1e15f; }

struct Repaired {
    std::size_t values = 0, pixels = 0;
};

/// RGBA -> RGB; what is not finite, or as good as infinite, becomes 0 and is marked in `finite`, which stays empty if
/// all is.
Repaired takeColor(const ImageF& rgba, ImageF& rgb, ImageF& finite)
{
    rgb = ImageF(rgba.width(), rgba.height(), 3);
    Repaired repaired;
    for (std::size_t i = 0; i < rgb.size() / 3; ++i) {
        const float* from = rgba.data() + 4 * i;
        float* to = rgb.data() + 3 * i;
        std::copy_n(from, 3, to);
        if (isUsable(from[0]) && isUsable(from[1]) && isUsable(from[2])) continue;
        if (finite.empty()) finite = ImageF(rgba.width(), rgba.height(), 1, 1.0f);
        finite.data()[i] = 0.0f;
        ++repaired.pixels;
        for (int j = 0; j < 3; ++j)
            if (!isUsable(to[j])) to[j] = 0.0f, ++repaired.values;
    }
    return repaired;
}

}  // namespace

std::vector<WindowSpan> windowSpans(std::size_t frames, std::size_t window)
{
    if (2 * frames <= 3 * window) return {{0, frames, 0, frames, 0}};
    std::vector<WindowSpan> spans;
    const std::size_t hop = std::max<std::size_t>(1, window / 2), last = frames - window;
    for (std::size_t first = 0;; first = std::min(first + hop, last)) {
        const std::size_t fade = spans.empty() ? 0 : spans.back().first + window - first;
        const std::size_t to = first == last ? frames : std::min(first + hop, last);
        spans.push_back({first, window, first, to, fade});
        if (first == last) return spans;
    }
}

void FootageWindow::add(FootageWindow&& more)
{
    // Masks are there for all frames or for none.
    if (finite.empty() != more.finite.empty()) {
        FootageWindow& without = finite.empty() ? *this : more;
        for (const ImageF& frame : without.frames) without.finite.emplace_back(frame.width(), frame.height(), 1, 1.0f);
    }
    append(numbers, std::move(more.numbers));
    append(frames, std::move(more.frames));
    append(finite, std::move(more.finite));
    append(coverages, std::move(more.coverages));
    append(extras, std::move(more.extras));
}

void FootageWindow::dropBefore(FrameNumber number)
{
    const auto count = std::size_t(std::lower_bound(numbers.begin(), numbers.end(), number) - numbers.begin());
    erase(numbers, count);
    erase(frames, count);
    erase(finite, count);
    erase(coverages, count);
    erase(extras, count);
}

ExtractFootage::ExtractFootage(const ExtractJobOptions& options)
{
    io::ReadOptions read;
    read.colorspace = options.colorspace;
    read.ocio = options.ocio;
    read.fps = options.fps;
    read.onError = onErrorOf(options.onError);
    read.stack = options.stack;
    read.stream = options.stream;
    read.layer = options.layer;
    read.view = options.view;
    read.deinterlace = options.deinterlace;
    reader_ = io::openPlate(options.footage, read);
    frames_ = chooseFrames(options.frames, reader_->info(), read.onError);
    std::sort(frames_.begin(), frames_.end());
}

FootageWindow ExtractFootage::readLinear(const std::vector<FrameNumber>& numbers)
{
    FootageWindow window;
    reader_->schedule(numbers);
    for (const FrameNumber number : numbers) {
        const Timer timer;
        std::optional<io::PlateFrame> frame = reader_->read(number);
        seconds_ += timer.seconds();
        const bool isFirstTime = asked_.insert(number).second;
        if (!frame) {
            if (isFirstTime) repairedFrames_.push_back(fmt::format("frame {} was skipped", number));
            continue;
        }
        if (isFirstTime && !frame->repaired.empty()) repairedFrames_.push_back(frame->repaired);
        FootageWindow one;
        one.numbers = {number};
        one.frames.resize(1);
        ImageF finite;
        const Repaired repaired = takeColor(frame->pixels, one.frames[0], finite);
        if (isFirstTime) repairedValues_ += repaired.values;
        damagedPixels_ += repaired.pixels;
        pixels_ += one.frames[0].size() / 3;
        if (!finite.empty()) one.finite.push_back(std::move(finite));
        if (info().hasAlpha) {
            ImageF& coverage = one.coverages.emplace_back(info().width, info().height, 1);
            for (std::size_t i = 0; i < coverage.size(); ++i) coverage.data()[i] = frame->pixels.data()[4 * i + 3];
        }
        one.extras.push_back(frame->extras);
        window.add(std::move(one));
    }
    return window;
}

void ExtractFootage::judgeChannels(const FootageWindow& linear)
{
    for (const ImageF& frame : linear.frames)
        for (std::size_t i = 0; i < frame.size(); i += 3)
            if (frame.data()[i] != frame.data()[i + 1] || frame.data()[i] != frame.data()[i + 2]) return;
    channels_ = 1;
}

void ExtractFootage::toModel(FootageWindow& linear, ModelSpace space) const
{
    parallelFor(0, std::ptrdiff_t(linear.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (auto k = std::size_t(first); k < std::size_t(last); ++k) {
            ImageF& frame = linear.frames[k];
            if (channels_ == 1) {
                ImageF grey(frame.width(), frame.height(), 1);
                for (std::size_t i = 0; i < grey.size(); ++i) grey.data()[i] = frame.data()[3 * i];
                frame = std::move(grey);
            }
            shot::toModel(frame, space);
        }
    });
}

}  // namespace virga::shot
