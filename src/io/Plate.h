// Plates in and out: what the floors above see of movies and image sequences. FFmpeg, OpenImageIO and OpenColorIO are
// named in this folder's .cpp files alone.
//
// Pixels cross this border as scene-linear, premultiplied RGBA float32 in the plate's own primaries, top row first
// (docs/conventions.md); io converts on both sides, such that pixels that nobody changed come back as the codes that
// they were. (Colour under an alpha of 0 is lost where a format keeps it straight.)
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/Error.h"
#include "core/FrameRange.h"
#include "core/Image.h"
#include "core/PictureRows.h"
#include "core/Timeline.h"

namespace virga::io {

/// What to do with a frame that cannot be read (`--on-error`).
enum class OnError {
    Stop,  ///< throw Error(Input) naming the file and the frame
    Skip,  ///< leave the frame out of the result
    Hold,  ///< use the last good frame before it (the first good one after it if there is none)
};

class ColorConfig;
struct ColorClaim;

struct ReadOptions {
    std::string colorspace;     ///< the plate's colour space by name; empty: from metadata, file rules, else guess
    std::string ocio;           ///< file with the OpenColorIO configuration; empty: $OCIO's, else the built-in one
    std::optional<double> fps;  ///< overrides what the file says [1/s]
    std::optional<FrameNumber> firstFrame;  ///< number of a movie's first frame (0)
    OnError onError = OnError::Stop;
    int stack = 0;              ///< the file is one image in which so many frames stand top to bottom; 0: it is not
    std::optional<int> stream;  ///< which of a movie's video streams, counted from 0; nothing: the default one
    std::string layer;          ///< of an EXR, "diffuse"; empty: see choosePicture
    std::string view;           ///< of an EXR with several, "right"; empty: the default one
    bool deinterlace = false;   ///< a movie's frames are made of both their fields' lines at one time (Deinterlacer.h)
    Timeline* timeline = nullptr;  ///< gets what the reader's threads do; must outlive the reader
};

/// How the lines of a movie's frames were taken.
enum class Scan {
    Unknown,      ///< neither container nor decoder says
    Progressive,  ///< all at once
    TopFirst,     ///< interlaced: the lines 0, 2, 4 ... earlier by half a frame
    BottomFirst,  ///< interlaced: the lines 1, 3, 5 ... earlier
};
constexpr bool isInterlaced(Scan scan) { return scan == Scan::TopFirst || scan == Scan::BottomFirst; }
/// "unknown", "progressive", "interlaced, top field first", "interlaced, bottom field first".
const char* scanWords(Scan scan);

struct PlateInfo {
    std::string path;  ///< as the user gave it; of a folder the pattern of the sequence in it
    bool isMovie = false;
    bool isStill = false;  ///< one image, no pattern
    int width = 0, height = 0;
    double fps = 24;  ///< frames per second (average, for a variable rate) [1/s]
    bool isVariableRate = false;
    double pixelAspect = 1;           ///< width of a pixel / its height
    std::vector<FrameNumber> frames;  ///< every frame that exists, ascending; a sequence may have holes
    bool hasAlpha = false;
    int bitDepth = 8;                           ///< of a channel in the file; 16 and 32 for half and float
    bool isFloat = false;                       ///< half or float file
    std::string colorspace;                     ///< the colour space that the pixels are converted from
    std::string colorspaceSource;               ///< why: "flag", "metadata: ...", "file rules of ...", "guess: ..."
    std::string workingColorspace;              ///< what they are converted to: linear
    std::shared_ptr<const ColorConfig> colors;  ///< where these names mean something; the writer looks them up there
    std::string format;                         ///< for the log: "h264 yuv420p", "openexr half"
    Scan scan = Scan::Unknown;                  ///< of a movie, as the file has it
    std::vector<std::string> layers, views;     ///< of an EXR
    std::vector<std::string> beside;            ///< what an EXR holds beside the picture: channels and parts, in words
    bool hasOverscan = false;  ///< its picture reaches beyond the display window, which is `width` wide
    int overscanX = 0, overscanY = 0;  ///< how far, on the farther side, of the first frame; at most the frame's own size
    std::vector<std::string> videoStreams;      ///< of a movie, each in words; ReadOptions::stream counts them
    std::string cleanAperture;    ///< of a movie, in words: what is to be shown of the picture; empty: all
    bool isDeinterlaced = false;  ///< ReadOptions::deinterlace was asked for and done
};

/// Metadata, time stamps, source pixels: what a frame carries through to the writer untouched. Opaque above io.
struct FrameExtras;

struct PlateFrame {
    FrameNumber number = 0;
    double time_s = 0;  ///< presentation time from the start of the plate (number / fps for sequences) [s]
    ImageF pixels;      ///< RGBA
    std::shared_ptr<const RowSource> rows{};  ///< Pixels::Rows: makes what `pixels` would hold; else null
    std::shared_ptr<const FrameExtras> extras;
    std::string repaired;  ///< empty, or a sentence: "held from frame 12: ..."
    /// Frames of one reader that have the same one have the same pixels: stills, frames held in a movie. 0: not known.
    std::uint64_t content = 0;
};

/// As what the pixels of a frame are asked for.
enum class Pixels {
    Light,  ///< as PlateFrame says
    Rows,   ///< as light, but made when they are asked for, out of the codes: PlateFrame::rows, and no `pixels`. Frames
            ///< that have no codes in planes (images, turned movies, packed pixels) come as light all the same
    Codes,  ///< as the file has them, for PlateWriter::takesCodes alone: the image is empty, the codes are in `extras`.
            ///< Frames that have no such codes (images, movies that are turned to be shown) come as light all the same
};

/// The frame with `x` columns and `y` rows more on each side: of its overscan, and 0 where there is none.
ImageF withOverscan(const PlateFrame& frame, int x, int y);

/// How pixels of YCbCr share a chroma sample: 2^shiftX columns of 2^shiftY rows.
struct SharedChroma {
    int shiftX = 0, shiftY = 0;
};

/// Reads frames by number, ahead of time on its own threads when they are asked for in the order of `schedule`.
class PlateReader {
public:
    virtual ~PlateReader() = default;
    virtual const PlateInfo& info() const = 0;

    /// How the result shares chroma. Chroma that the plate's pixels share and the result's do not is interpolated, by
    /// its siting; what both share is repeated, so that it comes back as it was, and so is all chroma unless this is
    /// called. Before the first frame is asked for.
    virtual void fitChroma(SharedChroma) {}

    /// Frames that will be asked for, in order: lets the reader decode ahead and skip what nobody wants.
    virtual void schedule(const std::vector<FrameNumber>& frames, Pixels pixels = Pixels::Light) = 0;

    /// The frame, or nothing if it is damaged and OnError::Skip is set. Throws Error(Input) naming file and frame.
    virtual std::optional<PlateFrame> read(FrameNumber number) = 0;
};

/// Frames that a reader holds before they are asked for, or reads: about 400 MB of them, one to eight.
std::size_t framesReadAhead(const PlateInfo& info);

/// Opens a movie, one image, a pattern ("shot.%04d.exr", "shot.####.exr"), or the one sequence in a folder. Throws
/// Error(Input).
std::unique_ptr<PlateReader> openPlate(const std::string& path, const ReadOptions& options);

/// How a movie is encoded where neither its name nor the plate should decide. Empty: they do.
struct MovieOptions {
    std::string container;     ///< FFmpeg's name, or the end of a file's name: "matroska", "mkv"
    std::string pixelFormat;   ///< FFmpeg's name: "yuv422p10le"
    std::string profile;       ///< of the codec: "4444", "main10"
    std::string preset;        ///< of the encoder: "slow", "8"
    std::string codecOptions;  ///< FFmpeg's options of the encoder: "qp=0,bf=2"
};

struct WriteOptions {
    std::string outputColorspace;   ///< empty: the plate's own
    std::string codec;              ///< FFmpeg encoder name, or compression of EXR and TIFF; empty: as the plate
    std::optional<double> quality;  ///< CRF or quantiser of the codec; 1..100 for JPEG
    std::optional<bool> half;       ///< EXR channels as half, or as float; nothing: float if the plate is, else half
    bool layers = false;            ///< EXR: write RenderedFrame::layers beside the beauty
    /// What an image's "Software" says; nothing: what the plate's says. EXR, PNG, TIFF, JPEG, DPX and Targa hold it.
    std::function<std::string(FrameNumber)> software{};
    MovieOptions movie{};
    Timeline* timeline = nullptr;  ///< gets what the writer's threads do; must outlive the writer
};

/// What a writer's frames that are not written yet hold at most [bytes], unless one alone is larger.
constexpr std::size_t mostBytesToWrite = std::size_t(1) << 30;

/// One named image of a frame: channel c of `pixels` is written as "<name>.<channels[c]>".
struct Layer {
    std::string name;                   ///< "rain", "splash", "fog", "plate"
    std::vector<std::string> channels;  ///< {"R","G","B","A"}, {"Z"}, {"x","y"}
    ImageF pixels;
    bool isData = false;  ///< no colour conversion: depth, motion
};

struct RenderedFrame {
    FrameNumber number = 0;
    ImageF beauty;  ///< RGBA; empty if it is the plate frame in Pixels::Codes, or on `canvas`
    std::vector<Layer> layers;
    std::shared_ptr<const FrameExtras> extras;  ///< of the plate frame
    ImageF
        around{};  ///< of withOverscan's frame; what is not the frame in it goes into the overscan. Empty: that stays
    bool isPlate = false;               ///< beauty is the plate's pixels, not one of them touched
    std::shared_ptr<RowSink> canvas{};  ///< of PlateWriter::canvas, filled, in the place of `beauty`; or null
};

/// Writes frames in the order given, encoding on its own thread. Everything is made under a temporary name in the
/// output's folder and renamed when whole; unless finish() is called the destructor removes what is unfinished
/// (frames of a sequence that were completed stay).
///
/// A movie made from a movie keeps the time stamps of the plate's frames as long as they come in ascending order, holes
/// included, with the sound cut to match; out of order they run on at the average rate, without sound from there on.
class PlateWriter {
public:
    virtual ~PlateWriter() = default;
    /// Whether the plate's codes can be encoded as they are, which gives what their light would, sooner.
    virtual bool takesCodes() const { return false; }
    virtual SharedChroma sharedChroma() const { return {}; }
    /// A picture to be filled and handed to write(), in which light becomes the file's codes at once; null where the
    /// writer takes light alone. Any number may be out.
    virtual std::shared_ptr<RowSink> canvas() { return nullptr; }
    /// May block while earlier frames are being encoded. Throws Error(Output) for this or an earlier frame.
    virtual void write(RenderedFrame frame) = 0;
    /// Closes the file so that it plays, copies sound, renames. Also the right call after Ctrl-C. Without any frame
    /// there is no movie, and a warning.
    virtual void finish() = 0;
};

/// `path`: a movie, one image (only for one frame), or a pattern. Checks the folder, the format, the codec and the size
/// before anything is rendered; throws Error(Output), Error(InvalidArgument) for a codec nobody knows.
/// `plate` gives sound, metadata, time stamps and defaults, and must outlive the writer.
std::unique_ptr<PlateWriter> createPlateWriter(const std::string& path, const PlateReader& plate,
                                               const WriteOptions& options);

/// Throws what createPlateWriter would, and neither makes nor removes a file.
void checkPlateWriter(const std::string& path, const PlateReader& plate, const WriteOptions& options);

struct MovieCopyResult {
    std::string obstacle;    ///< why nothing was copied, and no file made; empty if it was
    std::size_t frames = 0;  ///< copied, from the first one asked for on
};
/// Frames that nobody touches: the packets of the plate's movie into another file of the same container, unchanged,
/// with what createPlateWriter's would hold beside the pictures. `frames`: consecutive and ascending; less than all of
/// them only if they can be cut out exactly (CopyRange.h). Nothing is decoded: damage goes along, as does the display
/// matrix of a plate that is turned to be shown. goesOn(frames copied) is asked before each group of pictures; false
/// ends the movie there. Throws Error(Output) as createPlateWriter does.
MovieCopyResult copyMovie(const std::string& path, const PlateReader& plate, const std::vector<FrameNumber>& frames,
                          const std::string& container, const std::function<bool(std::size_t copied)>& goesOn);

/// An image file as it is: all channels, no colour conversion. For depth ("Z"), mattes, panoramas' raw values.
struct RawImage {
    ImageF pixels;
    std::vector<std::string> channelNames;  ///< as in the file: "R", "Z", "rain.A"
    bool isFloat = false;                   ///< half or float in the file; integers are NOT scaled to 0..1 here
    int bitDepth = 8;
    bool isDisplayReferred = false;  ///< 8/16-bit picture formats that hold sRGB-like values
};
RawImage readRawImage(const std::string& path);

/// A colour picture as scene-linear RGB(A) float, in the working space of the colour space that it is in: `colorspace`,
/// else what the file says, else what the rules of `ocio` say, else a guess. `found`, if not null, gets which and why.
ImageF readLinearImage(const std::string& path, const std::string& colorspace = {}, const std::string& ocio = {},
                       ColorClaim* found = nullptr);

/// Writes RGB(A) or single-channel float EXR with the given channel names, atomically. compression: OpenImageIO's word.
/// Throws Error(Output).
void writeExr(const std::string& path, ConstImageViewF pixels, const std::vector<std::string>& channelNames, bool half,
              const char* compression = "zip");
/// RGB(A) in linear light of Rec.709 -> 8-bit sRGB PNG, atomically. Values outside 0..1 are clipped. Throws
/// Error(Output).
void writePng(const std::string& path, ConstImageViewF linear);
/// The same from `space` of `colors`, such as a plate's working space. Data, and a space that no way leads from to
/// sRGB, is shown as if it were Rec.709: a picture to look at is better than none.
void writePng(const std::string& path, ConstImageViewF linear, const ColorConfig& colors, const std::string& space);

/// What the file's "Software" says, if all of its pixels can be read; else, and if there is no file, empty.
std::string wholeImageSoftware(const std::string& path);
/// Whether files of this name keep it.
bool keepsSoftware(const std::string& path);

/// Names of one frame's file when `pattern` has %04d, #### , @ or $F4; `pattern` itself if it has none.
std::string framePath(const std::string& pattern, FrameNumber number);
bool isFramePattern(const std::string& pattern);
/// Throws Error(code) for a pattern with two places for the number ("a.%04d.%04d.exr"). One # or @ before another place
/// is text, as in "take#2.%04d.exr".
void refuseTwoPatterns(const std::string& pattern, ErrorCode code);
/// Frames of a pattern that exist on disk, ascending. Throws Error(Input) for a pattern with two places, and naming the
/// folder looked at if it is missing.
std::vector<FrameNumber> findFrames(const std::string& pattern);

/// The frame of which framePath(pattern, frame) ends in the file's name `fileName`; nothing if it is no frame's.
std::optional<FrameNumber> frameNumberOf(const std::string& pattern, const std::string& fileName);

}  // namespace virga::io
