// Images out: one file a frame, each whole before it has its name, written by a few threads.

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <mutex>
#include <set>
#include <string_view>
#include <thread>

#include "core/Error.h"
#include "core/Log.h"
#include "io/BackgroundQueue.h"
#include "io/ColorConversion.h"
#include "io/ImageColor.h"
#include "io/ImageFile.h"
#include "io/Writers.h"

namespace virga::io {

namespace {

int writerThreads() { return int(std::clamp(std::thread::hardware_concurrency(), 1u, 8u)); }

class SequenceWriter final : public PlateWriter {
public:
    SequenceWriter(const std::string& path, const PlateInfo& plate, const MovieOrigin* origin,
                   const WriteOptions& options)
        : pattern_(path), plate_(plate), format_(imageFormatOf(path)), isPattern_(isFramePattern(path)),
          withLayers_(options.layers), software_(options.software)
    {
        if (options.layers && format_ != "openexr")
            throw Error(ErrorCode::InvalidArgument, "{}: only EXR files hold layers; name the output .exr", path);
        chooseSamples(options);
        chooseCompression(options);
        colorspace_ = options.outputColorspace.empty() ? defaultOutputColorspace(plate, isFloat())
                                                       : plate.colors->resolve(options.outputColorspace);
        toFile_ = plate.colors->transform(plate.workingColorspace, colorspace_);
        ownSpace_ = plate.colors->equivalent(colorspace_);
        writesAlpha_ = options.layers || (plate.hasAlpha && formatHasAlpha(path));
        if (plate.hasAlpha && !writesAlpha_) log::warning("{}: {} files have no alpha; it is left out", path, format_);
        if (origin != nullptr && isPattern_) log::detail("{}: images carry no sound", path);
    }

    void write(RenderedFrame frame) override
    {
        if (!isPattern_ && written_++ > 0)
            throw Error(ErrorCode::Output,
                        "{}: is one image, but there are several frames; name a pattern such as shot.%04d.exr",
                        pattern_);
        auto shared = std::make_shared<RenderedFrame>(std::move(frame));
        queue_.push([this, shared] { writeFile(*shared); });
    }

    void finish() override
    {
        queue_.drain();
        if (clamped_ > 0)
            log::warning("{}: {} values beyond the range of half float were held at 65504", pattern_, clamped_.load());
    }

private:
    bool isFloat() const { return samples_ == SampleType::Half || samples_ == SampleType::Float; }

    void chooseSamples(const WriteOptions& options)
    {
        const bool plateIsFull = plate_.isFloat && plate_.bitDepth > 16;
        if (format_ == "openexr") {
            samples_ = options.half.value_or(!plateIsFull) ? SampleType::Half : SampleType::Float;
        } else if (format_ == "hdr" || format_ == "pnm" || (format_ == "tiff" && plate_.isFloat)) {
            samples_ = format_ == "pnm" ? SampleType::UInt8 : SampleType::Float;
        } else if (format_ == "dpx") {
            samples_ = SampleType::UInt16;
            const int depth = plate_.isFloat ? 10 : plate_.bitDepth;
            bits_ = depth <= 10 ? 10 : depth <= 12 ? 12 : 16;
        } else if (format_ == "png" || format_ == "tiff") {
            samples_ = plate_.bitDepth > 8 ? SampleType::UInt16 : SampleType::UInt8;
        } else {
            samples_ = SampleType::UInt8;
        }
    }

    void chooseCompression(const WriteOptions& options)
    {
        static const std::set<std::string> exr = {"none",  "rle", "zip",  "zips", "piz",
                                                  "pxr24", "b44", "b44a", "dwaa", "dwab"};
        static const std::set<std::string> tiff = {"none", "lzw", "zip", "packbits"};
        const std::set<std::string>* known = format_ == "openexr" ? &exr : format_ == "tiff" ? &tiff : nullptr;
        if (!options.codec.empty()) {
            if (known == nullptr)
                throw Error(ErrorCode::InvalidArgument, "codec '{}': {} files have none to choose", options.codec,
                            format_);
            if (!known->contains(options.codec))
                throw Error(ErrorCode::InvalidArgument, "codec '{}' is not known for {} files; there are {}",
                            options.codec, format_, fmt::join(*known, ", "));
            compression_ = options.codec;
            if (options.quality && (options.codec == "dwaa" || options.codec == "dwab"))
                compression_ += fmt::format(":{:g}", *options.quality);
        } else if (format_ == "jpeg" || format_ == "webp") {
            compression_ = fmt::format("{}:{:.0f}", format_, std::clamp(options.quality.value_or(95), 1.0, 100.0));
        }
    }

    /// As the plate, if that loses nothing: what the rain does not touch has to come back.
    std::string compressionFor(const RenderedFrame& frame) const
    {
        if (!compression_.empty() || format_ != "openexr") return compression_;
        static const std::set<std::string> lossless = {"none", "rle", "zip", "zips", "piz"};
        if (frame.extras && frame.extras->fileFormat == format_)
            for (const Attribute& attribute : frame.extras->attributes)
                if (attribute.name == "compression" && attribute.strings.size() == 1 &&
                    lossless.contains(attribute.strings[0]))
                    return attribute.strings[0];
        return "zip";
    }

    /// Metadata of the plate's frame, less what the output makes untrue.
    std::vector<Attribute> attributesFor(const RenderedFrame& frame) const
    {
        std::vector<Attribute> result;
        if (!frame.extras) {
            addColorspace(result);
            return result;
        }
        const bool sameFormat = frame.extras->fileFormat == format_, sameColor = colorspace_ == plate_.colorspace;
        for (const Attribute& attribute : frame.extras->attributes) {
            if (attribute.name == "compression") continue;
            if (!sameColor && isOfColor(attribute.name)) continue;
            // "dpx:Transfer" and the like mean something in their own format alone.
            if (!sameFormat && attribute.name.starts_with(frame.extras->fileFormat + ":")) continue;
            result.push_back(attribute);
        }
        addColorspace(result);
        return result;
    }

    static bool isOfColor(std::string_view name)
    {
        static constexpr std::string_view names[] = {"chromaticities", "colorInteropID", "acesImageContainerFlag",
                                                     "adoptedNeutral", "Exif:ColorSpace"};
        return name.starts_with("ICCProfile") || std::find(std::begin(names), std::end(names), name) != std::end(names);
    }

    /// EXR files say which space they are in: its primaries, and its name as the Color Interop Forum has it. What the
    /// plate said of the same space stays.
    void addColorspace(std::vector<Attribute>& attributes) const
    {
        if (format_ != "openexr" || ownSpace_ == nullptr) return;
        const auto isSaid = [&](const char* name) {
            return std::any_of(attributes.begin(), attributes.end(),
                               [&](const Attribute& a) { return a.name == name; });
        };
        if (!isSaid("colorInteropID"))
            attributes.push_back({"colorInteropID", "string", {}, {interopIdOf(*ownSpace_)}});
        if (isSaid("chromaticities") || ownSpace_->primaries == nullptr || ownSpace_->primaries->isXyz) return;
        const std::array<float, 8> values = chromaticitiesOf(*ownSpace_->primaries);
        Attribute attribute{"chromaticities", "float[8]", std::vector<std::byte>(sizeof values), {}};
        std::memcpy(attribute.data.data(), values.data(), sizeof values);
        attributes.push_back(std::move(attribute));
    }

    void writeFile(RenderedFrame& frame)
    {
        static const char* const rgba[] = {"R", "G", "B", "A"};
        if (frame.beauty.width() != plate_.width || frame.beauty.height() != plate_.height ||
            frame.beauty.channels() != 4)
            throw Error(ErrorCode::Internal, "frame {} is {}x{} with {} channels where the plate is {}x{}",
                        frame.number, frame.beauty.width(), frame.beauty.height(), frame.beauty.channels(),
                        plate_.width, plate_.height);
        ImageToWrite image;
        image.isStraight = writesAlpha_ && !isFloat();
        image.bits = bits_;
        image.compression = compressionFor(frame);
        image.pixelAspect = plate_.pixelAspect;
        image.fps = isPattern_ ? plate_.fps : 0;
        image.attributes = attributesFor(frame);
        if (software_) {
            std::erase_if(image.attributes, [](const Attribute& a) { return a.name == "Software"; });
            image.attributes.push_back({"Software", "string", {}, {software_(frame.number)}});
        }

        convert(frame.beauty, image.isStraight);
        for (int c = 0; c < (writesAlpha_ ? 4 : 3); ++c) image.channels.push_back({rgba[c], samples_, frame.beauty, c});
        if (withLayers_) {
            for (Layer& layer : frame.layers) {
                if (!layer.isData && layer.channels.size() >= 3) convert(layer.pixels, false);
                // Half would round a depth of 100 m to 6 cm and motion to steps that show.
                const SampleType samples = layer.isData ? SampleType::Float : samples_;
                for (std::size_t c = 0; c < layer.channels.size(); ++c)
                    image.channels.push_back({layer.name + "." + layer.channels[c], samples, layer.pixels, int(c)});
            }
        }
        clamped_ += writeImageFile(isPattern_ ? framePath(pattern_, frame.number) : pattern_, image);
    }

    /// A pixel that is not opaque keeps its alpha; where the file has none the picture is over black already.
    void convert(ImageF& pixels, bool straight) const
    {
        if (writesAlpha_ || pixels.channels() == 3) {
            linearToCodes(pixels, *toFile_, straight);
        } else if (!toFile_->isIdentity()) {
            for (int y = 0; y < pixels.height(); ++y)
                for (int x = 0; x < pixels.width(); ++x) pixels.at(x, y, 3) = 1.0f;
            linearToCodes(pixels, *toFile_, false);
        }
    }

    std::string pattern_;
    const PlateInfo plate_;
    std::string format_;
    bool isPattern_;
    bool withLayers_;
    std::function<std::string(FrameNumber)> software_;
    bool writesAlpha_ = false;
    SampleType samples_ = SampleType::UInt8;
    int bits_ = 0;
    std::string compression_, colorspace_;
    const NamedSpace* ownSpace_ = nullptr;  // the same as colorspace_, if it is one that we know
    std::shared_ptr<const ColorTransform> toFile_;
    int written_ = 0;
    std::atomic<std::size_t> clamped_ = 0;
    BackgroundQueue queue_{writerThreads(), 2};  // last, so that its threads end before what they use
};

}  // namespace

std::unique_ptr<PlateWriter> createSequenceWriter(const std::string& path, const PlateInfo& plate,
                                                  const MovieOrigin* origin, const WriteOptions& options)
{
    return std::make_unique<SequenceWriter>(path, plate, origin, options);
}

}  // namespace virga::io
