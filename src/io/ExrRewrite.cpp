#include "io/ExrRewrite.h"

#include <OpenEXR/Iex.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfChromaticitiesAttribute.h>
#include <OpenEXR/ImfDeepScanLineInputPart.h>
#include <OpenEXR/ImfDeepScanLineOutputPart.h>
#include <OpenEXR/ImfDeepTiledInputPart.h>
#include <OpenEXR/ImfDeepTiledOutputPart.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfRationalAttribute.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfTiledInputPart.h>
#include <OpenEXR/ImfTiledOutputPart.h>

#include <cmath>
#include <cstring>
#include <set>

#include "core/Error.h"
#include "io/AtomicFile.h"
#include "io/HalfRow.h"

namespace virga::io {

namespace {

constexpr int rowsPerBand = 256;  // as much as the largest of OpenEXR's blocks (DWAB)

/// Samples of one channel over a window, rows packed.
struct Plane {
    Imf::PixelType type = Imf::HALF;
    int stepX = 1, stepY = 1;  ///< of pixels, from one sample to the next
    std::vector<std::byte> samples;
};

std::size_t bytesOf(Imf::PixelType type) { return type == Imf::HALF ? 2 : 4; }

int floorDiv(int a, int b) { return a / b - (a % b < 0 ? 1 : 0); }

Imf::Compression compressionNamed(const std::string& name)
{
    static const std::map<std::string, Imf::Compression> known = {
        {"none", Imf::NO_COMPRESSION},  {"rle", Imf::RLE_COMPRESSION},   {"zips", Imf::ZIPS_COMPRESSION},
        {"zip", Imf::ZIP_COMPRESSION},  {"piz", Imf::PIZ_COMPRESSION},   {"pxr24", Imf::PXR24_COMPRESSION},
        {"b44", Imf::B44_COMPRESSION},  {"b44a", Imf::B44A_COMPRESSION}, {"dwaa", Imf::DWAA_COMPRESSION},
        {"dwab", Imf::DWAB_COMPRESSION}};
    const auto found = known.find(name);
    return found != known.end() ? found->second : Imf::ZIP_COMPRESSION;
}

bool losesNothing(Imf::Compression compression)
{
    return compression == Imf::NO_COMPRESSION || compression == Imf::RLE_COMPRESSION ||
           compression == Imf::ZIPS_COMPRESSION || compression == Imf::ZIP_COMPRESSION ||
           compression == Imf::PIZ_COMPRESSION;
}

Imath::Box2i boxOf(const Window& w) { return {{w.x, w.y}, {w.right() - 1, w.bottom() - 1}}; }

class Rewrite {
public:
    Rewrite(const std::string& from, const ExrChanges& changes) : c_(changes), in_(from.c_str())
    {
        for (int i = 0; i < in_.parts(); ++i) headers_.push_back(in_.header(i));
        if (c_.part >= in_.parts()) throw Error(ErrorCode::Input, "{}: has changed while it was worked on", from);
        layOut();
        for (Imf::Header& header : headers_) describe(header);
    }

    std::size_t write(const std::string& to)
    {
        Imf::MultiPartOutputFile out(to.c_str(), headers_.data(), int(headers_.size()), true);
        for (int i = 0; i < int(headers_.size()); ++i) {
            if (i == c_.part && !copies_)
                writePicture(out);
            else
                copyPart(out, i);
        }
        return held_;
    }

private:
    /// Decides window, channels and compression of the picture's part.
    void layOut()
    {
        Imf::Header& header = headers_[std::size_t(c_.part)];
        const Imf::PixelType asked = c_.samples == SampleType::Float ? Imf::FLOAT : Imf::HALF;
        for (const std::string& name : c_.channels)
            if (const Imf::Channel* channel = name.empty() ? nullptr : header.channels().findChannel(name.c_str()))
                isRetyped_ = isRetyped_ || (c_.samples && channel->type != asked);
        copies_ = c_.isUntouched && c_.layers.empty() && c_.compression.empty() && !isRetyped_;
        if (copies_) return;

        window_ = c_.data;
        if (reachesBeyondData()) window_ = united(window_, c_.display);
        header.dataWindow() = boxOf(window_);
        if (header.hasTileDescription()) {
            Imf::TileDescription tiles = header.tileDescription();
            tiles.mode = Imf::ONE_LEVEL;
            header.setTileDescription(tiles);
        }
        if (!c_.compression.empty()) {
            header.compression() = compressionNamed(c_.compression);
            if (c_.quality) header.dwaCompressionLevel() = float(*c_.quality);
        } else if (!losesNothing(header.compression())) {
            header.compression() = Imf::ZIP_COMPRESSION;
        }
        header.erase("preview");  // a small picture of what was there before

        const bool wasGrey = c_.channels[0] == c_.channels[1];
        names_ = c_.channels;
        Imf::ChannelList& list = header.channels();
        const Imf::Channel* first = list.findChannel(names_[0].c_str());
        const Imf::PixelType type = c_.samples ? asked : first != nullptr ? first->type : Imf::HALF;
        if (wasGrey && !isGrey()) {
            const std::string before = names_[0].substr(0, names_[0].rfind('.') + 1);  // "left.Y"
            Imf::ChannelList others;
            for (auto i = list.begin(); i != list.end(); ++i)
                if (i.name() != names_[0]) others.insert(i.name(), i.channel());
            list = others;
            names_ = {before + "R", before + "G", before + "B", names_[3]};
        }
        for (const std::string& name : names_) {
            if (name.empty()) continue;
            const Imf::Channel* known = list.findChannel(name.c_str());
            Imf::Channel channel = known != nullptr ? *known : Imf::Channel(type);
            if (c_.samples) channel.type = asked;
            list.insert(name.c_str(), channel);
        }
        for (const ChannelToWrite& layer : c_.layers)
            list.insert(layer.name.c_str(), Imf::Channel(layer.type == SampleType::Float ? Imf::FLOAT : Imf::HALF));
    }

    bool reachesBeyondData() const
    {
        if (c_.data.contains(c_.display)) return false;
        const bool hasAlpha = !c_.channels[3].empty();
        for (int y = 0; y < c_.display.height; ++y)
            for (int x = 0; x < c_.display.width; ++x) {
                if (c_.data.contains({c_.display.x + x, c_.display.y + y, 1, 1})) continue;
                const float* p = c_.picture.pixel(x, y);
                if (p[0] != 0 || p[1] != 0 || p[2] != 0 || (hasAlpha && p[3] != 0)) return true;
            }
        return false;
    }

    bool isGrey() const
    {
        for (int y = 0; y < c_.picture.height(); ++y)
            for (int x = 0; x < c_.picture.width(); ++x) {
                const float* p = c_.picture.pixel(x, y);
                if (std::memcmp(p, p + 1, sizeof *p) != 0 || std::memcmp(p, p + 2, sizeof *p) != 0) return false;
            }
        return true;
    }

    void describe(Imf::Header& header) const
    {
        if (c_.dropsColour)
            for (const char* name : {"chromaticities", "adoptedNeutral", "colorInteropID", "acesImageContainerFlag"})
                header.erase(name);
        // SMPTE ST 2065-4: half, not compressed, and nothing but the picture.
        if (!copies_ && header.findTypedAttribute<Imf::IntAttribute>("acesImageContainerFlag") != nullptr &&
            (!c_.layers.empty() || header.compression() != Imf::NO_COMPRESSION || c_.samples == SampleType::Float))
            header.erase("acesImageContainerFlag");
        if (c_.chromaticities && !Imf::hasChromaticities(header)) {
            const auto& v = *c_.chromaticities;
            Imf::addChromaticities(header, Imf::Chromaticities({v[0], v[1]}, {v[2], v[3]}, {v[4], v[5]}, {v[6], v[7]}));
        }
        if (!c_.interopId.empty() && header.findTypedAttribute<Imf::StringAttribute>("colorInteropID") == nullptr)
            header.insert("colorInteropID", Imf::StringAttribute(c_.interopId));
        for (const auto& [name, text] : c_.texts) {
            header.erase(name.c_str());
            header.insert(name.c_str(), Imf::StringAttribute(text));
        }
        if (c_.fps > 0) setRate(header);
    }

    /// Leaves a rate of the same value as it is; OpenImageIO spells it FramesPerSecond.
    void setRate(Imf::Header& header) const
    {
        const auto [num, den] = rateFraction(c_.fps);
        for (const char* name : {"framesPerSecond", "FramesPerSecond"}) {
            const auto* said = header.findTypedAttribute<Imf::RationalAttribute>(name);
            if (said != nullptr && std::fabs(double(said->value()) - c_.fps) < 1e-6 * c_.fps) return;
            header.erase(name);
        }
        Imf::addFramesPerSecond(header, Imf::Rational(num, unsigned(den)));
    }

    void copyPart(Imf::MultiPartOutputFile& out, int i)
    {
        const std::string type = headers_[std::size_t(i)].type();
        const auto copy = [&]<class Out, class In>(Out to, In from) { to.copyPixels(from); };
        if (type == Imf::TILEDIMAGE)
            copy(Imf::TiledOutputPart(out, i), Imf::TiledInputPart(in_, i));
        else if (type == Imf::DEEPSCANLINE)
            copy(Imf::DeepScanLineOutputPart(out, i), Imf::DeepScanLineInputPart(in_, i));
        else if (type == Imf::DEEPTILE)
            copy(Imf::DeepTiledOutputPart(out, i), Imf::DeepTiledInputPart(in_, i));
        else
            copy(Imf::OutputPart(out, i), Imf::InputPart(in_, i));
    }

    /// A plane holds the samples of `band_`.
    Imf::Slice sliceOf(Plane& plane) const
    {
        const auto bytes = std::ptrdiff_t(bytesOf(plane.type));
        const std::ptrdiff_t columns = floorDiv(band_.right() - 1, plane.stepX) - floorDiv(band_.x, plane.stepX) + 1;
        // Where sample (0, 0) of the plane of pixels would be.
        char* origin =
            reinterpret_cast<char*>(plane.samples.data()) -
            (std::ptrdiff_t(floorDiv(band_.y, plane.stepY)) * columns + floorDiv(band_.x, plane.stepX)) * bytes;
        return {plane.type, origin, std::size_t(bytes), std::size_t(bytes * columns), plane.stepX, plane.stepY};
    }

    /// Float rows -> samples of a plane. `from`: of the pixel at `at`, which is in the band.
    void fill(Plane& plane, int x, int y, const float* from, int step, int count)
    {
        const std::size_t bytes = bytesOf(plane.type);
        std::byte* to = plane.samples.data() +
                        (std::size_t(y - band_.y) * std::size_t(band_.width) + std::size_t(x - band_.x)) * bytes;
        if (plane.type == Imf::HALF)
            held_ += halvesFromFloats(from, std::size_t(step), to, bytes, std::size_t(count));
        else
            for (int i = 0; i < count; ++i) std::memcpy(to + std::size_t(i) * bytes, from + i * step, bytes);
    }

    void fillFrom(Plane& plane, ConstImageViewF pixels, int channel, const Window& place)
    {
        const Window both = overlap(place, band_);
        for (int y = both.y; y < both.bottom() && both.width > 0; ++y)
            fill(plane, both.x, y, pixels.pixel(both.x - place.x, y - place.y) + channel, pixels.channels(),
                 both.width);
    }

    /// Whether the part is written from its first row to its last, each on its own.
    static bool goesByBands(const Imf::Header& header)
    {
        if (header.hasTileDescription() || header.lineOrder() != Imf::INCREASING_Y) return false;
        for (auto i = header.channels().begin(); i != header.channels().end(); ++i)
            if (i.channel().ySampling != 1) return false;
        return true;
    }

    void writePicture(Imf::MultiPartOutputFile& out)
    {
        const Imf::Header& header = headers_[std::size_t(c_.part)];
        if (header.hasTileDescription()) {
            band_ = window_;
            std::map<std::string, Plane> planes;
            Imf::TiledOutputPart part(out, c_.part);
            part.setFrameBuffer(fillBand(planes));
            part.writeTiles(0, part.numXTiles() - 1, 0, part.numYTiles() - 1);
            return;
        }
        Imf::OutputPart part(out, c_.part);
        const int rows = goesByBands(header) ? rowsPerBand : window_.height;
        for (int y = window_.y; y < window_.bottom(); y += rows) {
            band_ = window_;
            band_.y = y;
            band_.height = std::min(rows, window_.bottom() - y);
            std::map<std::string, Plane> planes;
            part.setFrameBuffer(fillBand(planes));
            part.writePixels(band_.height);
        }
    }

    /// What the part has in the band: the picture, the layers, and what is kept of the file.
    Imf::FrameBuffer fillBand(std::map<std::string, Plane>& planes)
    {
        const Imf::Header& header = headers_[std::size_t(c_.part)];
        Imf::FrameBuffer read, written;
        std::set<std::string> fresh(names_.begin(), names_.end());
        for (const ChannelToWrite& layer : c_.layers) fresh.insert(layer.name);
        bool isAnyKept = false;
        for (auto i = header.channels().begin(); i != header.channels().end(); ++i) {
            const Imf::Channel& channel = i.channel();
            Plane& plane = planes[i.name()];
            plane.type = channel.type;
            plane.stepX = channel.xSampling;
            plane.stepY = channel.ySampling;
            const auto columns =
                std::size_t(floorDiv(band_.right() - 1, plane.stepX) - floorDiv(band_.x, plane.stepX) + 1);
            const auto rows =
                std::size_t(floorDiv(band_.bottom() - 1, plane.stepY) - floorDiv(band_.y, plane.stepY) + 1);
            plane.samples.resize(columns * rows * bytesOf(plane.type));
            written.insert(i.name(), sliceOf(plane));
            if (fresh.contains(i.name())) continue;
            read.insert(i.name(), sliceOf(plane));
            isAnyKept = true;
        }
        const Window kept = overlap(c_.data, band_);
        if (isAnyKept && kept.height > 0) {
            Imf::InputPart part(in_, c_.part);
            part.setFrameBuffer(read);
            part.readPixels(kept.y, kept.bottom() - 1);
        }
        const int count = names_[0] == names_[1] ? 1 : 3;
        for (int channel = 0; channel < 4; ++channel) {
            const std::string& name = names_[std::size_t(channel)];
            if (name.empty() || (channel < 3 && channel >= count)) continue;
            if (!c_.overscan.empty()) fillFrom(planes[name], c_.overscan, channel, c_.data);
            fillFrom(planes[name], c_.picture, channel, c_.display);
        }
        for (const ChannelToWrite& layer : c_.layers)
            fillFrom(planes[layer.name], layer.pixels, layer.index, c_.display);
        return written;
    }

    const ExrChanges& c_;
    Imf::MultiPartInputFile in_;
    std::vector<Imf::Header> headers_;
    std::array<std::string, 4> names_;  // of the picture in the new file
    Window window_;                     // its data window there
    Window band_;                       // the rows of it that are written now
    bool isRetyped_ = false, copies_ = false;
    std::size_t held_ = 0;
};

}  // namespace

std::size_t rewriteExr(const std::string& from, const std::string& to, const ExrChanges& changes)
{
    std::optional<Rewrite> rewrite;
    try {
        rewrite.emplace(from, changes);
    } catch (const std::exception& error) {
        if (dynamic_cast<const Error*>(&error) != nullptr) throw;
        throw Error(ErrorCode::Input, "{}: cannot be read again ({})", from, error.what());
    }
    AtomicFile file(to);
    std::size_t held = 0;
    try {
        held = rewrite->write(file.temporaryPath());
    } catch (const Iex::InputExc& error) {
        throw Error(ErrorCode::Input, "{}: is damaged or cut off ({})", from, error.what());
    } catch (const std::exception& error) {
        if (dynamic_cast<const Error*>(&error) != nullptr) throw;
        throw Error(ErrorCode::Output, "{}: cannot be written from {} ({})", to, from, error.what());
    }
    file.commit();
    return held;
}

}  // namespace virga::io
