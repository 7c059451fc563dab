// Stored depth, one frame at a time, out of images and movies, and what of the file it is.
#pragma once

#include <limits>
#include <memory>
#include <string>

#include "depth/DepthPacking.h"
#include "io/Plate.h"
#include "shot/Settings.h"

namespace virga::shot {

struct StoredDepth {
    ImageF values;    ///< one channel, in the file's units: integers are not scaled to 0..1
    double full = 1;  ///< the largest value of the file's type; 1 for half and float
    /// From here on a value is sky: 65504 in half files, 1e10 in float ones, none in others.
    double sky = std::numeric_limits<double>::infinity();
};

struct PicturesInMemory;

class DepthReader {
public:
    /// inMemory: holds the depth if settings.depth is PicturesInMemory::depthName. Throws Error(Input) if there is no
    /// such file, no frame of the pattern, or no movie that can be read.
    explicit DepthReader(const Settings& settings, std::shared_ptr<const PicturesInMemory> inMemory = nullptr);

    /// One file for every frame.
    bool isOne() const { return !movie_ && !isPattern_; }
    /// Frames that there are, ascending; of one file none.
    std::vector<FrameNumber> frames() const;
    /// What a sentence calls the frame's depth: its file, or the movie.
    std::string nameOf(FrameNumber frame) const;

    /// Throws Error(Input) naming file and frame.
    StoredDepth read(FrameNumber frame);

private:
    bool isPacked() const { return packing_ != depth::DepthPacking::None; }
    int channelOf(const io::RawImage& image, const std::string& path);
    StoredDepth fromMovie(FrameNumber frame);

    std::string path_, channel_;
    bool isPattern_;
    depth::DepthPacking packing_;
    std::unique_ptr<io::PlateReader> movie_;
    std::shared_ptr<const PicturesInMemory> inMemory_;  // null: files
    bool saidKind_ = false;
};

}  // namespace virga::shot
