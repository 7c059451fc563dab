// The frames of footage as the extraction wants them: a window at a time, in the values of the model.
#pragma once

#include <memory>
#include <set>
#include <vector>

#include "io/Plate.h"
#include "shot/ExtractJob.h"
#include "shot/ModelSpace.h"

namespace virga::shot {

/// Some frames, in order; every vector has one entry a frame or is empty.
struct FootageWindow {
    std::vector<FrameNumber> numbers;
    std::vector<ImageF> frames;     // 1 or 3 channels, finite
    std::vector<ImageF> finite;     // 0 where a value was not, 1 elsewhere; empty: all are
    std::vector<ImageF> coverages;  // the plate's alpha; empty: it has none
    std::vector<std::shared_ptr<const io::FrameExtras>> extras;

    std::size_t size() const { return numbers.size(); }
    void add(FootageWindow&& more);
    /// Takes the frames before `number` away.
    void dropBefore(FrameNumber number);
};

/// Frames [first, first + count) solved together, of which [from, to) are delivered; the first `fade` of these from
/// what the window before made of them to what this one does, evenly, so that no frame shows where windows meet.
struct WindowSpan {
    std::size_t first, count, from, to, fade;
};

/// One span where the footage is no longer than one and a half windows; else windows that overlap by half or more.
std::vector<WindowSpan> windowSpans(std::size_t frames, std::size_t window);

class ExtractFootage {
public:
    /// Opens it. Throws Error(Input), Error(InvalidArgument) for frames that a movie does not have.
    explicit ExtractFootage(const ExtractJobOptions& options);

    io::PlateReader& reader() { return *reader_; }
    const io::PlateInfo& info() const { return reader_->info(); }
    /// Those to deliver, ascending.
    const std::vector<FrameNumber>& frames() const { return frames_; }
    int channels() const { return channels_; }
    std::size_t repairedValues() const { return repairedValues_; }
    /// Of all pixels that were read, those with a value that is not finite.
    double damagedShare() const { return pixels_ > 0 ? double(damagedPixels_) / double(pixels_) : 0.0; }
    const std::vector<std::string>& repairedFrames() const { return repairedFrames_; }
    double seconds() const { return seconds_; }  ///< spent waiting for frames

    /// Frames in linear light, RGB. Those that cannot be read are left out if options.onError says so.
    FootageWindow readLinear(const std::vector<FrameNumber>& numbers);

    /// One channel from now on, if these are grey in every pixel.
    void judgeChannels(const FootageWindow& linear);

    /// To the values of the model and as many channels as the footage needs.
    void toModel(FootageWindow& linear, ModelSpace space) const;

private:
    std::unique_ptr<io::PlateReader> reader_;
    std::vector<FrameNumber> frames_;
    int channels_ = 3;
    std::set<FrameNumber> asked_;  // some frames are read twice: for the survey and for their window
    std::size_t repairedValues_ = 0, damagedPixels_ = 0, pixels_ = 0;
    std::vector<std::string> repairedFrames_;
    double seconds_ = 0;
};

}  // namespace virga::shot
