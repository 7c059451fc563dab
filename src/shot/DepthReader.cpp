#include "shot/DepthReader.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/Error.h"
#include "core/Log.h"
#include "io/ImageFile.h"
#include "shot/PicturesInMemory.h"

namespace virga::shot {
namespace {

constexpr double halfSky = 65504, floatSky = 1e10;

double largestOf(int bits) { return std::exp2(bits) - 1; }

depth::DepthPacking packingOf(const Settings& s)
{
    using depth::DepthPacking;
    static constexpr std::pair<std::string_view, DepthPacking> packings[] = {{"rg", DepthPacking::Rg},
                                                                             {"gr", DepthPacking::Gr},
                                                                             {"rgb", DepthPacking::Rgb},
                                                                             {"bgr", DepthPacking::Bgr},
                                                                             {"hue", DepthPacking::Hue}};
    for (const auto& [name, packing] : packings)
        if (s.depthPacking == name) return packing;
    return DepthPacking::None;
}

int channelsOf(depth::DepthPacking packing)
{
    return packing == depth::DepthPacking::Rg || packing == depth::DepthPacking::Gr ? 2 : 3;
}

}  // namespace

DepthReader::DepthReader(const Settings& settings, std::shared_ptr<const PicturesInMemory> inMemory)
    : path_(settings.depth), channel_(settings.depthChannel), isPattern_(io::isFramePattern(settings.depth)),
      packing_(packingOf(settings))
{
    if (inMemory && path_ == PicturesInMemory::depthName) {
        inMemory_ = std::move(inMemory);
        isPattern_ = true;  // one a frame
    } else if (isPattern_) {
        if (io::findFrames(path_).empty())
            throw Error(ErrorCode::Input, "depth '{}': no frame of that pattern exists", path_);
    } else if (!std::filesystem::exists(path_)) {
        throw Error(ErrorCode::Input, "depth '{}': no such file", path_);
    } else if (!io::isImageName(path_)) {
        io::ReadOptions options;
        options.colorspace = "raw";
        if (settings.depthFirstFrame) {
            if (*settings.depthFirstFrame != std::round(*settings.depthFirstFrame))
                throw Error(ErrorCode::InvalidArgument, "--depth-first-frame '{}': must be a whole number",
                            *settings.depthFirstFrame);
            options.firstFrame = FrameNumber(*settings.depthFirstFrame);
        }
        movie_ = io::openPlate(path_, options);
        const io::PlateInfo& info = movie_->info();
        if (isPacked() && info.bitDepth != 8)
            throw Error(ErrorCode::Input, "depth '{}': is {}; packed depth has channels of 8 bits", path_, info.format);
        if (isPacked() && !depth::survivesLoss(packing_) && info.format.find("yuv") != std::string::npos)
            throw Error(
                ErrorCode::Input,
                "depth '{}': is {}; depth in several channels needs 8-bit RGB without loss, as conversion to YCbCr "
                "and compression change the higher byte",
                path_, info.format);
    }
}

std::vector<FrameNumber> DepthReader::frames() const
{
    if (inMemory_) return {};
    return movie_ ? movie_->info().frames : isPattern_ ? io::findFrames(path_) : std::vector<FrameNumber>();
}

std::string DepthReader::nameOf(FrameNumber frame) const
{
    if (inMemory_) return fmt::format("{}, picture {}", path_, inMemory_->depthContent);
    return movie_ ? fmt::format("{}, frame {}", path_, frame) : isPattern_ ? io::framePath(path_, frame) : path_;
}

StoredDepth DepthReader::read(FrameNumber frame)
{
    if (inMemory_) return inMemory_->depth;
    if (movie_) return fromMovie(frame);
    const std::string path = nameOf(frame);
    if (!std::filesystem::exists(path))
        throw Error(ErrorCode::Input, "frame {}: its depth '{}' does not exist", frame, path);
    const io::RawImage raw = io::readRawImage(path);
    StoredDepth stored;
    stored.full = raw.isFloat ? 1 : largestOf(raw.bitDepth);
    stored.values = ImageF(raw.pixels.width(), raw.pixels.height(), 1);
    if (raw.isFloat) stored.sky = raw.bitDepth == 16 ? halfSky : floatSky;
    const int packed = isPacked() ? channelsOf(packing_) : 0;
    if (isPacked()) {
        if (raw.isFloat || raw.bitDepth != 8 || raw.pixels.channels() < packed)
            throw Error(ErrorCode::Input, "depth '{}': has no {} channels of 8 bits to hold packed depth", path,
                        packed);
        stored.full = depth::largestPacked(packing_);
    }
    const int channel = isPacked() ? 0 : channelOf(raw, path);
    for (int y = 0; y < stored.values.height(); ++y)
        for (int x = 0; x < stored.values.width(); ++x) {
            const float* pixel = raw.pixels.pixel(x, y);
            stored.values.at(x, y) =
                isPacked() ? float(depth::unpackedDepth(packing_, {pixel[0], pixel[1], packed > 2 ? pixel[2] : 0}))
                           : pixel[channel];
        }
    return stored;
}

/// A layer of depth is called Z, depth.Z or the like; else the first channel is taken.
int DepthReader::channelOf(const io::RawImage& image, const std::string& path)
{
    const auto& names = image.channelNames;
    const auto index = [&](const auto& found) { return int(found - names.begin()); };
    if (!channel_.empty()) {
        const auto found = std::find(names.begin(), names.end(), channel_);
        if (found == names.end())
            throw Error(ErrorCode::Input, "depth '{}': has no channel '{}'; it has {}", path, channel_,
                        fmt::join(names, ", "));
        return index(found);
    }
    const auto isZ = [](const std::string& name) {
        return name == "Z" || name == "z" || name.ends_with(".Z") || name.ends_with(".z");
    };
    std::vector<std::string> candidates;
    std::copy_if(names.begin(), names.end(), std::back_inserter(candidates), isZ);
    const auto plain = std::find(names.begin(), names.end(), "Z");
    if (candidates.size() > 1 && plain == names.end())
        throw Error(ErrorCode::Input, "depth '{}': several channels hold depth, {}; --depth-channel names one", path,
                    fmt::join(candidates, ", "));
    if (!saidKind_ && image.isDisplayReferred && image.bitDepth == 8)
        log::warning("depth '{}' has 8 bits a pixel: 256 levels of depth", path);
    if (!saidKind_ && candidates.empty() && names.size() > 1)
        log::warning("depth '{}' has no channel Z; its '{}' is taken", path, names[0]);
    saidKind_ = true;
    if (plain != names.end()) return index(plain);
    return candidates.empty() ? 0 : index(std::find_if(names.begin(), names.end(), isZ));
}

StoredDepth DepthReader::fromMovie(FrameNumber frame)
{
    const io::PlateInfo& info = movie_->info();
    if (!std::binary_search(info.frames.begin(), info.frames.end(), frame))
        throw Error(ErrorCode::Input, "frame {}: the depth '{}' has frames {} alone; --depth-first-frame moves them",
                    frame, path_, formatFrameRange(info.frames));
    const std::optional<io::PlateFrame> read = movie_->read(frame);
    StoredDepth stored;
    const double full = largestOf(info.bitDepth);
    stored.full = isPacked() ? depth::largestPacked(packing_) : full;
    stored.values = ImageF(info.width, info.height, 1);
    for (int y = 0; y < info.height; ++y)
        for (int x = 0; x < info.width; ++x) {
            const float* rgba = read->pixels.pixel(x, y);
            // Codes are whole numbers; what is near one is one.
            const auto code = [&](int channel) { return std::round(rgba[channel] * full); };
            stored.values.at(x, y) =
                float(isPacked() ? depth::unpackedDepth(packing_, {code(0), code(1), code(2)}) : code(0));
        }
    return stored;
}

}  // namespace virga::shot
