// Images out: one file a frame, each whole before it has its name, written by a few threads.

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <set>
#include <string_view>
#include <thread>

#include "core/Error.h"
#include "core/Log.h"
#include "io/AtomicFile.h"
#include "io/BackgroundQueue.h"
#include "io/ColorConversion.h"
#include "io/ExrRewrite.h"
#include "io/ImageColor.h"
#include "io/ImageFile.h"
#include "io/Overscan.h"
#include "io/SampleForm.h"
#include "io/Writers.h"

namespace virga::io {

namespace {

int writerThreads() { return int(std::clamp(std::thread::hardware_concurrency(), 1u, 8u)); }

class SequenceWriter final : public PlateWriter {
public:
    SequenceWriter(const std::string& path, const PlateInfo& plate, const MovieOrigin* origin,
                   const WriteOptions& options)
        : pattern_(path), plate_(plate), options_(options), format_(imageFormatOf(path)),
          isPattern_(isFramePattern(path)), holdsAlpha_(formatHasAlpha(path))
    {
        if (options.layers && format_ != "openexr")
            throw Error(ErrorCode::InvalidArgument, "{}: only EXR files hold layers; name the output .exr", path);
        chooseCompression();
        const bool isFloat = sampleFormOf(format_, holdsAlpha_, plate, nullptr, options.half).isFloat();
        colorspace_ = options.outputColorspace.empty() ? defaultOutputColorspace(plate, isFloat)
                                                       : plate.colors->resolve(options.outputColorspace);
        toFile_ = plate.colors->transform(plate.workingColorspace, colorspace_);
        ownSpace_ = plate.colors->equivalent(colorspace_);
        if (plate.hasAlpha && !holdsAlpha_) log::warning("{}: {} files have no alpha; it is left out", path, format_);
        if (origin != nullptr && isPattern_) log::detail("{}: images carry no sound", path);
    }

    void write(RenderedFrame frame) override
    {
        if (!isPattern_ && written_++ > 0)
            throw Error(ErrorCode::Output,
                        "{}: is one image, but there are several frames; name a pattern such as shot.%04d.exr",
                        pattern_);
        const std::size_t bytes = bytesOf(frame);
        auto shared = std::make_shared<RenderedFrame>(std::move(frame));
        queue_.push(
            [this, shared] {
                const StageSpan span(options_.timeline, "writer", "write", shared->number);
                writeFile(*shared);
            },
            bytes);
        shared.reset();
        // One of that size is enough in memory: the next is begun when it is written.
        if (bytes > mostBytesToWrite) queue_.drain();
    }

    void finish() override
    {
        queue_.drain();
        if (clamped_ > 0)
            log::warning("{}: {} values beyond the range of half float were held at 65504", pattern_, clamped_.load());
    }

private:
    void chooseCompression()
    {
        static const std::set<std::string> exr = {"none",  "rle", "zip",  "zips", "piz",
                                                  "pxr24", "b44", "b44a", "dwaa", "dwab"};
        static const std::set<std::string> tiff = {"none", "lzw", "zip", "packbits"};
        const std::set<std::string>* known = format_ == "openexr" ? &exr : format_ == "tiff" ? &tiff : nullptr;
        const std::string& codec = options_.codec;
        if (!codec.empty()) {
            if (known == nullptr)
                throw Error(ErrorCode::InvalidArgument, "codec '{}': {} files have none to choose", codec, format_);
            if (!known->contains(codec))
                throw Error(ErrorCode::InvalidArgument, "codec '{}' is not known for {} files; there are {}", codec,
                            format_, fmt::join(*known, ", "));
            compression_ = codec;
            if (options_.quality && (codec == "dwaa" || codec == "dwab"))
                compression_ += fmt::format(":{:g}", *options_.quality);
        } else if (format_ == "jpeg" || format_ == "webp") {
            compression_ = fmt::format("{}:{:.0f}", format_, std::clamp(options_.quality.value_or(95), 1.0, 100.0));
        }
    }

    /// Metadata of the plate's frame, less what the output makes untrue.
    std::vector<Attribute> attributesFor(const RenderedFrame& frame) const
    {
        std::vector<Attribute> result;
        if (frame.extras) {
            const bool sameFormat = frame.extras->fileFormat == format_;
            for (const Attribute& attribute : frame.extras->attributes) {
                const std::string_view name = attribute.name;
                if (name == "compression" || (!isSameColor() && isOfColor(name))) continue;
                // "dpx:Transfer" and the like mean something in their own format alone, as do views.
                if (!sameFormat && (name.starts_with(frame.extras->fileFormat + ":") || name == "multiView" ||
                                    name == "view" || name == "acesImageContainerFlag"))
                    continue;
                result.push_back(attribute);
            }
        }
        addColorspace(result);
        if (options_.software) {
            std::erase_if(result, [](const Attribute& a) { return a.name == "Software"; });
            result.push_back({"Software", "string", {}, {options_.software(frame.number)}});
        }
        return result;
    }

    bool isSameColor() const { return colorspace_ == plate_.colorspace; }

    static bool isOfColor(std::string_view name)
    {
        static constexpr std::string_view names[] = {"chromaticities", "colorInteropID", "acesImageContainerFlag",
                                                     "adoptedNeutral", "Exif:ColorSpace"};
        return name.starts_with("ICCProfile") || std::find(std::begin(names), std::end(names), name) != std::end(names);
    }

    /// EXR files say which space they are in: its primaries, if there are any.
    std::optional<std::array<float, 8>> ownChromaticities() const
    {
        if (ownSpace_ == nullptr || ownSpace_->primaries == nullptr || ownSpace_->primaries->isXyz) return std::nullopt;
        return chromaticitiesOf(*ownSpace_->primaries);
    }

    /// ... and its name as the Color Interop Forum has it. What the plate said of the same space stays.
    void addColorspace(std::vector<Attribute>& attributes) const
    {
        if (format_ != "openexr" || ownSpace_ == nullptr) return;
        const auto isSaid = [&](const char* name) {
            return std::any_of(attributes.begin(), attributes.end(),
                               [&](const Attribute& a) { return a.name == name; });
        };
        if (!isSaid("colorInteropID"))
            attributes.push_back({"colorInteropID", "string", {}, {interopIdOf(*ownSpace_)}});
        const auto values = ownChromaticities();
        if (isSaid("chromaticities") || !values) return;
        Attribute attribute{"chromaticities", "float[8]", std::vector<std::byte>(sizeof *values), {}};
        std::memcpy(attribute.data.data(), values->data(), sizeof *values);
        attributes.push_back(std::move(attribute));
    }

    void writeFile(RenderedFrame& frame)
    {
        if (frame.beauty.width() != plate_.width || frame.beauty.height() != plate_.height ||
            frame.beauty.channels() != 4)
            throw Error(ErrorCode::Internal, "frame {} is {}x{} with {} channels where the plate is {}x{}",
                        frame.number, frame.beauty.width(), frame.beauty.height(), frame.beauty.channels(),
                        plate_.width, plate_.height);
        const std::string path = isPattern_ ? framePath(pattern_, frame.number) : pattern_;
        const bool isOfFile = frame.extras && frame.extras->fileFormat == format_ && !frame.extras->file.path.empty();
        if (isOfFile && format_ == "openexr")
            clamped_ += rewrite(path, frame);
        else if (isOfFile && frame.isPlate && isFileKept())
            copyFile(frame.extras->file.path, path);
        else
            clamped_ += writeAnew(path, frame);
    }

    /// Formats that lose something each time: a frame to which nothing happens is its file.
    bool isFileKept() const { return (format_ == "jpeg" || format_ == "webp") && isSameColor() && !options_.quality; }

    static void copyFile(const std::string& from, const std::string& to)
    {
        AtomicFile file(to);
        std::error_code error;
        std::filesystem::copy_file(from, file.temporaryPath(), std::filesystem::copy_options::overwrite_existing,
                                   error);
        if (error) throw Error(ErrorCode::Output, "{}: cannot be written ({})", to, error.message());
        file.commit();
    }

    /// The layers as channels. Colours are converted in place.
    std::vector<ChannelToWrite> layerChannels(RenderedFrame& frame, SampleType samples) const
    {
        std::vector<ChannelToWrite> channels;
        if (!options_.layers) return channels;
        for (Layer& layer : frame.layers) {
            if (!layer.isData && layer.channels.size() >= 3) linearToCodes(layer.pixels, *toFile_, false);
            for (std::size_t c = 0; c < layer.channels.size(); ++c)
                // Half would round a depth of 100 m to 6 cm and motion to steps that show.
                channels.push_back({layer.name + "." + layer.channels[c], layer.isData ? SampleType::Float : samples,
                                    layer.pixels, int(c)});
        }
        return channels;
    }

    /// An EXR out of an EXR: what else is in the plate's file comes along.
    std::size_t rewrite(const std::string& path, RenderedFrame& frame) const
    {
        const PlateFile& file = frame.extras->file;
        ExrChanges changes;
        changes.part = file.part;
        changes.channels = file.channelNames;
        changes.data = file.data;
        changes.display = file.display;
        changes.isUntouched = frame.isPlate && isSameColor();
        if (options_.half) changes.samples = *options_.half ? SampleType::Half : SampleType::Float;
        const bool isOpaque = file.channelNames[3].empty();
        if (options_.layers && isOpaque)
            changes.channels[3] = file.channelNames[0].substr(0, file.channelNames[0].rfind('.') + 1) + "A";
        ImageF overscan = file.overscan;
        if (!frame.around.empty() && !overscan.empty()) takeOverscan(frame.around, file, overscan);
        for (ImageF* pixels : {&frame.beauty, &overscan})
            if (!pixels->empty()) convert(*pixels, {.hasAlpha = !changes.channels[3].empty()});
        changes.picture = frame.beauty;
        changes.overscan = overscan;
        const SampleForm form = sampleFormOf(format_, holdsAlpha_, plate_, frame.extras.get(), options_.half);
        changes.layers = layerChannels(frame, form.samples);
        changes.compression = options_.codec;
        changes.quality = options_.quality;
        changes.dropsColour = !isSameColor();
        changes.chromaticities = ownChromaticities();
        if (ownSpace_ != nullptr) changes.interopId = interopIdOf(*ownSpace_);
        if (options_.software) changes.texts["Software"] = options_.software(frame.number);
        changes.fps = isPattern_ ? plate_.fps : 0;
        return rewriteExr(file.path, path, changes);
    }

    std::size_t writeAnew(const std::string& path, RenderedFrame& frame) const
    {
        static const char* const rgba[] = {"R", "G", "B", "A"};
        SampleForm form = sampleFormOf(format_, holdsAlpha_, plate_, frame.extras.get(), options_.half);
        form.hasAlpha = form.hasAlpha || options_.layers;
        ImageToWrite image;
        image.isStraight = form.isStraight;
        image.bits = form.bits;
        image.compression = compression_.empty() && format_ == "openexr" ? "zip" : compression_;
        image.pixelAspect = plate_.pixelAspect;
        image.fps = isPattern_ ? plate_.fps : 0;
        image.attributes = attributesFor(frame);

        // A picture without colours in a format that knows them is grey, as the plate is.
        const bool isGrey = frame.extras && frame.extras->isGrey && holdsGrey() && isColourless(frame.beauty);
        convert(frame.beauty, form);
        for (int c = isGrey ? 2 : 0; c < (form.hasAlpha ? 4 : 3); ++c)
            image.channels.push_back({isGrey && c == 2 ? "Y" : rgba[c], form.samples, frame.beauty, c});
        for (ChannelToWrite& channel : layerChannels(frame, form.samples)) image.channels.push_back(std::move(channel));
        return writeImageFile(path, image);
    }

    bool holdsGrey() const
    {
        return format_ == "png" || format_ == "tiff" || format_ == "jpeg" || format_ == "openexr";
    }

    static bool isColourless(const ImageF& rgba)
    {
        for (std::size_t i = 0; i < rgba.size(); i += 4)
            if (rgba.data()[i] != rgba.data()[i + 1] || rgba.data()[i] != rgba.data()[i + 2]) return false;
        return true;
    }

    /// A pixel that is not opaque keeps its alpha; where the file has none the picture is over black already.
    void convert(ImageF& pixels, const SampleForm& form) const
    {
        if (!form.hasAlpha && !toFile_->isIdentity())
            for (int y = 0; y < pixels.height(); ++y)
                for (int x = 0; x < pixels.width(); ++x) pixels.at(x, y, 3) = 1.0f;
        if (form.hasAlpha || !toFile_->isIdentity()) linearToCodes(pixels, *toFile_, form.isStraight);
    }

    std::string pattern_;
    const PlateInfo plate_;
    const WriteOptions options_;
    std::string format_;
    bool isPattern_, holdsAlpha_;
    std::string compression_, colorspace_;
    const NamedSpace* ownSpace_ = nullptr;  // the same as colorspace_, if it is one that we know
    std::shared_ptr<const ColorTransform> toFile_;
    int written_ = 0;
    std::atomic<std::size_t> clamped_ = 0;
    BackgroundQueue queue_{writerThreads(), 2, mostBytesToWrite};  // last, so that its threads end before what they use
};

}  // namespace

std::unique_ptr<PlateWriter> createSequenceWriter(const std::string& path, const PlateInfo& plate,
                                                  const MovieOrigin* origin, const WriteOptions& options)
{
    return std::make_unique<SequenceWriter>(path, plate, origin, options);
}

}  // namespace virga::io
