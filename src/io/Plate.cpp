// Which reader or writer a name asks for.

#include "io/Plate.h"

#include <filesystem>

#include "core/Error.h"
#include "core/Log.h"
#include "io/AtomicFile.h"
#include "io/ColorConversion.h"
#include "io/FrameSource.h"
#include "io/ImageFile.h"
#include "io/MovieOutput.h"
#include "io/PlateName.h"
#include "io/Writers.h"

namespace virga::io {

std::size_t bytesOf(const RenderedFrame& frame)
{
    std::size_t values = frame.beauty.size() + frame.around.size();
    for (const Layer& layer : frame.layers) values += layer.pixels.size();
    return values * sizeof(float);
}

std::size_t framesReadAhead(const PlateInfo& info)
{
    const double bytes = 16.0 * std::max(1, info.width) * std::max(1, info.height);
    return std::size_t(std::clamp(400e6 / bytes, 1.0, 8.0));
}

namespace fs = std::filesystem;

namespace {

/// The same file by another name, as far as names tell (files that do not exist yet have nothing else).
bool namesSameFile(const std::string& a, const std::string& b)
{
    if (isSameFile(a, b)) return true;
    std::error_code error;
    return fs::weakly_canonical(a, error) == fs::weakly_canonical(b, error);
}

void refuseWritingOverPlate(const std::string& path, const PlateInfo& plate)
{
    if (!isFramePattern(plate.path)) {
        if (namesSameFile(path, plate.path))
            throw Error(ErrorCode::Output, "{}: is the plate itself; give the result another name", path);
        return;
    }
    for (const FrameNumber frame : plate.frames)
        if (isSameFile(framePath(path, frame), framePath(plate.path, frame)))
            throw Error(ErrorCode::Output, "{}: frame {} is a file of the plate itself; give the result another name",
                        path, frame);
}

void checkNames(const std::string& path, const PlateInfo& plate, const WriteOptions& options)
{
    if (path != standardOutput) {
        checkOutputFolder(path);
        refuseTwoPatterns(path, ErrorCode::Output);
        refuseWritingOverPlate(path, plate);
    }
    if (!options.outputColorspace.empty()) plate.colors->resolve(options.outputColorspace);
}

bool isMovieOutput(const std::string& path, const WriteOptions& options)
{
    return isMovieName(path) || (!options.movie.container.empty() && !isFramePattern(path));
}

/// A movie of images, which is made for the depth of the first one.
class MovieOfImages final : public PlateWriter {
public:
    MovieOfImages(std::unique_ptr<PlateWriter> movie, std::string path, int bitDepth)
        : movie_(std::move(movie)), path_(std::move(path)), bitDepth_(bitDepth)
    {
    }

    void write(RenderedFrame frame) override
    {
        if (frame.extras && frame.extras->bitDepth > bitDepth_)
            throw Error(ErrorCode::Input,
                        "frame {} has {} bits a channel, but {} is made for the {} of the first one; write images, or "
                        "bring all frames to one depth",
                        frame.number, frame.extras->bitDepth, path_, bitDepth_);
        movie_->write(std::move(frame));
    }
    void finish() override { movie_->finish(); }

private:
    std::unique_ptr<PlateWriter> movie_;
    std::string path_;
    int bitDepth_;
};

}  // namespace

const MovieOrigin* originOf(const PlateReader& plate)
{
    const auto* reader = dynamic_cast<const SourcedReader*>(&plate);
    return reader != nullptr ? reader->source().movie() : nullptr;
}

const char* scanWords(Scan scan)
{
    switch (scan) {
        case Scan::Progressive: return "progressive";
        case Scan::TopFirst: return "interlaced, top field first";
        case Scan::BottomFirst: return "interlaced, bottom field first";
        case Scan::Unknown: break;
    }
    return "unknown";
}

std::unique_ptr<PlateReader> openPlate(const std::string& name, const ReadOptions& options)
{
    if (name.empty()) throw Error(ErrorCode::Input, "the plate has no name");
    const std::string path = resolvePlateName(name);
    if (options.fps && !(*options.fps > 0 && *options.fps <= 10000))
        throw Error(ErrorCode::InvalidArgument, "fps is {}, which is not between 0 and 10000", *options.fps);
    if (options.stack > 0) return makeScheduledReader(openStack(path, options), options);
    auto source = isFramePattern(path) || isImageName(path) ? openImages(path, options) : openMovie(path, options);
    return makeScheduledReader(std::move(source), options);
}

std::unique_ptr<PlateWriter> createPlateWriter(const std::string& path, const PlateReader& plate,
                                               const WriteOptions& options)
{
    const PlateInfo& info = plate.info();
    checkNames(path, info, options);
    const bool isMovie = isMovieOutput(path, options);
    if (isMovie || imageFormatOf(path) != "openexr") {
        if (!info.beside.empty())
            log::warning("{}: holds the picture alone; left out of it are {}", path, fmt::join(info.beside, ", "));
        if (info.hasOverscan)
            log::warning("{}: the plate's picture reaches beyond its display window; that overscan is left out", path);
    }
    if (isMovie) {
        auto movie = createMovieWriter(path, info, originOf(plate), options);
        if (info.isMovie) return movie;
        return std::make_unique<MovieOfImages>(std::move(movie), path, info.bitDepth);
    }
    auto writer = createSequenceWriter(path, info, originOf(plate), options);
    sweepLeftovers(path);
    return writer;
}

void checkPlateWriter(const std::string& path, const PlateReader& plate, const WriteOptions& options)
{
    checkNames(path, plate.info(), options);
    if (isMovieOutput(path, options))
        checkMovieWriter(path, plate.info(), originOf(plate), options);
    else  // makes its files as their frames come
        createSequenceWriter(path, plate.info(), originOf(plate), options);
}

MovieCopyResult copyMovie(const std::string& path, const PlateReader& plate, const std::vector<FrameNumber>& frames,
                          const std::string& container, const std::function<bool(std::size_t)>& goesOn)
{
    checkNames(path, plate.info(), {});
    const MovieOrigin* origin = originOf(plate);
    if (origin == nullptr || !origin->keepsTime) return {"the plate's time stamps do not hold"};
    const std::vector<FrameNumber>& all = plate.info().frames;
    if (frames.empty() || frames.front() < all.front() || frames.back() > all.back())
        return {"not all of the frames are there"};
    if (!origin->isPlain) return {"not every packet of it is a frame that is whole and shown at its own time"};
    return copyMoviePackets(path, *origin, frames, container, goesOn);
}

std::shared_ptr<const ColorTransform> describeColor(PlateInfo& info, const ReadOptions& options,
                                                    const std::vector<ColorClaim>& said)
{
    info.colors = ColorConfig::open(options.ocio);
    const ColorClaim claim = chooseColorspace(*info.colors, options.colorspace, info.path, said);
    info.colorspace = claim.colorspace;
    info.colorspaceSource = claim.source;
    info.workingColorspace = info.colors->working(info.colorspace);
    return info.colors->transform(info.colorspace, info.workingColorspace);
}

std::string defaultOutputColorspace(const PlateInfo& plate, bool outputIsFloat)
{
    if (outputIsFloat) return plate.isFloat ? plate.colorspace : plate.workingColorspace;
    if (!plate.isFloat) return plate.colorspace;
    // Float into integers: displays and pictures have the curve of sRGB over the same primaries.
    const NamedSpace* working = plate.colors->equivalent(plate.workingColorspace);
    if (working == nullptr) return "sRGB";
    if (working->primaries == nullptr) return plate.workingColorspace;
    const NamedSpace* display = findOwnColorspace(Curve::Srgb, *working->primaries);
    return display != nullptr ? display->name : "sRGB";
}

}  // namespace virga::io
