// What the readers of movies and of sequences have in common below PlateReader.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "core/Window.h"
#include "io/ColorConversion.h"
#include "io/Plate.h"
#include "io/Yuv.h"

struct AVFrame;

namespace virga::io {

/// One piece of metadata of an image file, in OpenImageIO's words.
struct Attribute {
    std::string name;
    std::string type;                  ///< OpenImageIO TypeDesc, "int", "float[8]", "timecode"
    std::vector<std::byte> data;       ///< unless it is text
    std::vector<std::string> strings;  ///< the texts, for type "string"
};

/// Where the picture of a frame stands in its image file, so that the rest of that file can come along.
struct PlateFile {
    std::string path;                         ///< can be opened again
    int part = 0;                             ///< of an EXR with several
    std::array<std::string, 4> channelNames;  ///< of the picture, red to alpha, as in the file; empty: no alpha
    Window data, display;
    ImageF overscan;  ///< of the whole data window, as PlateFrame::pixels, if it reaches beyond the display window
};

struct FrameExtras {
    std::string fileFormat;             ///< "openexr", "png"; empty for movies
    std::vector<Attribute> attributes;  ///< of image files
    bool isGrey = false;                ///< one channel of colour in the file
    bool hasAlpha = false;
    bool isStraight = false;  ///< in the file, see ImageHeader
    int bitDepth = 0;         ///< of an image file's channels; 0 for movies
    bool isFloat = false;     ///< half or float file
    PlateFile file;           ///< path is empty where frame and file are not one
    std::shared_ptr<const AVFrame> codes;  ///< Pixels::Codes: the picture as decoded, of MovieOrigin::pixelFormat
};

struct Rational {
    int num = 0, den = 1;
    double value() const { return den != 0 ? double(num) / den : 0; }
};

/// When one frame of a movie is shown, in units of MovieOrigin::timeBase.
struct FrameTime {
    std::int64_t start = 0, duration = 0;
};

/// How one frame of a movie lies among the others in the file.
struct FrameCoding {
    std::size_t order = 0;  ///< of decoding, counted from 0
    bool isKey = false;     ///< the container says that decoding can begin here
};

/// What a movie's writer wants to know of the movie that the plate came from. Enumerators are FFmpeg's, as int.
struct MovieOrigin {
    std::string path;  ///< can be opened; of a pipe, the file that it was spooled into
    int streamIndex = 0;
    Rational timeBase, frameRate, pixelAspect;
    bool isVariableRate = false;
    FrameNumber firstFrame = 0;       ///< number of times[0]
    std::vector<FrameTime> times;     ///< in order of showing
    std::vector<FrameCoding> coded;   ///< of the same frames
    std::int64_t containerStart = 0;  ///< where the earliest of its streams begins, at least 0
    bool keepsTime = true;            ///< false if the user set another rate: the file's own times do not hold
    int codecId = 0, profile = 0, pixelFormat = 0;
    int range = 0, primaries = 0, transfer = 0, matrix = 0, chromaLocation = 0;  ///< as tagged
    YuvCoding coding;       ///< what the codes mean, by tags or guess
    bool isRangeGuessed = false, isMatrixGuessed = false;                        ///< nobody tagged these two
    bool isPlain = false;   ///< every packet of the stream is one frame, whole, at a time stamp of its own
    bool isTurned = false;  ///< rows became columns by the display matrix
    int fieldOrder = 0;     ///< of the pictures as they are handed out: AV_FIELD_*
    std::string timecode;   ///< of frame `firstFrame`, "01:00:00:00"; empty if there is none
};

/// Loads one frame. Frames may be asked for in any order; ascending is fastest.
class FrameSource {
public:
    virtual ~FrameSource() = default;
    virtual const PlateInfo& info() const = 0;
    /// Throws Error(Input) naming file and frame if it is missing or damaged.
    virtual PlateFrame load(FrameNumber number, Pixels pixels) = 0;
    /// See PlateReader::fitChroma.
    virtual void fitChroma(SharedChroma) {}
    /// How many threads may be in load() at once.
    virtual int parallelLoads() const { return 1; }
    /// The movie, or null for images.
    virtual const MovieOrigin* movie() const { return nullptr; }
};

/// Fills in the colour of `info`, whose path is set: the configuration, the space by options and `said` (see
/// chooseColorspace), the working space. Returns the way to it.
std::shared_ptr<const ColorTransform> describeColor(PlateInfo& info, const ReadOptions& options,
                                                    const std::vector<ColorClaim>& said);

std::unique_ptr<FrameSource> openMovie(const std::string& path, const ReadOptions& options);
/// One image or a pattern.
std::unique_ptr<FrameSource> openImages(const std::string& path, const ReadOptions& options);
/// One image whose rows are options.stack frames, top to bottom.
std::unique_ptr<FrameSource> openStack(const std::string& path, const ReadOptions& options);

/// A PlateReader that says where its frames come from. All readers that openPlate makes are one.
class SourcedReader : public PlateReader {
public:
    virtual const FrameSource& source() const = 0;
};

/// Where the reader's frames come from, if that is a movie; else null.
const MovieOrigin* originOf(const PlateReader& plate);

/// Adds reading ahead on threads and the OnError policy to a source.
std::unique_ptr<SourcedReader> makeScheduledReader(std::unique_ptr<FrameSource> source, const ReadOptions& options);

}  // namespace virga::io
