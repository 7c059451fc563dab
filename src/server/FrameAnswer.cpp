#include "server/FrameAnswer.h"

#include <algorithm>
#include <vector>

#include "core/Error.h"
#include "io/ColorConversion.h"
#include "io/ImageFile.h"
#include "server/Refusal.h"

namespace virga::server {
namespace {

/// A plate as the writer of images sees it: a description.
class Described final : public io::PlateReader {
public:
    explicit Described(io::PlateInfo info) : info_(std::move(info)) {}
    const io::PlateInfo& info() const override { return info_; }
    void schedule(const std::vector<FrameNumber>&, io::Pixels) override {}
    std::optional<io::PlateFrame> read(FrameNumber) override { return std::nullopt; }

private:
    io::PlateInfo info_;
};

bool isWanted(const FrameQuery& query, const io::Layer& layer)
{
    return query.wants(layer.isData && layer.channels.size() == 1 ? layer.name + ".Z" : layer.name);
}

/// The layer that a format of one picture is to show in the beauty's place; null for the beauty.
const io::Layer* layerShown(const Picture& picture, const FrameQuery& query)
{
    if (!query.wantsLayers()) return nullptr;
    if (query.layers.size() != 1 || query.wants("rain.Z") || query.wants("rain.motion"))
        throw Refusal(400, "invalid-argument",
                      "PNG and JPEG show one of the layers beauty, rain, splash, fog and plate; EXR and raw have all");
    for (const io::Layer& layer : picture.frame.layers)
        if (layer.channels.size() == 4 && isWanted(query, layer)) return &layer;
    throw Refusal(404, "no-layer", "layers '{}': there is none; nothing is rendered with these settings",
                  query.layers.front());
}

struct Planes {
    RawHeader header;
    std::vector<RawPlane> planes;
    std::vector<ImageF> converted;  // what the planes of another colour space lie in
};

Planes planesOf(const Picture& picture, const io::PlateInfo& plate, const FrameQuery& query)
{
    Planes result;
    result.header.data = picture.data;
    result.header.frameWidth = picture.frameWidth;
    result.header.frameHeight = picture.frameHeight;
    result.header.frame = picture.frame.number;
    result.header.isFloat = query.isFloat;
    const auto toCodes =
        query.colorspace.empty() ? nullptr : plate.colors->transform(plate.workingColorspace, query.colorspace);
    result.converted.reserve(1 + picture.frame.layers.size());
    const auto add = [&](const std::string& name, const std::vector<std::string>& channels, const ImageF& pixels,
                         bool isData) {
        ConstImageViewF from = pixels;
        if (toCodes && !toCodes->isIdentity() && !isData) {
            result.converted.push_back(pixels);
            io::linearToCodes(result.converted.back().view(), *toCodes, false);
            from = result.converted.back();
        }
        for (std::size_t c = 0; c < channels.size(); ++c) {
            result.header.planes.push_back(name.empty() ? channels[c] : name + "." + channels[c]);
            result.planes.push_back({from, int(c)});
        }
    };
    if (query.wants("beauty")) add("", {"R", "G", "B", "A"}, picture.frame.beauty, false);
    for (const io::Layer& layer : picture.frame.layers)
        if (isWanted(query, layer)) add(layer.name, layer.channels, layer.pixels, layer.isData);
    if (result.planes.empty())
        throw Refusal(404, "no-layer", "layers: there is none of these; nothing is rendered with these settings");
    return result;
}

}  // namespace

std::size_t Picture::bytes() const
{
    std::size_t values = frame.beauty.size();
    for (const io::Layer& layer : frame.layers) values += layer.pixels.size();
    return values * sizeof(float);
}

std::string encodeImage(const Picture& picture, const io::PlateInfo& plate, const shot::Settings& settings,
                        const FrameQuery& query, Format format)
{
    const bool isExr = format == Format::Exr;
    io::PlateInfo info = plate;
    info.width = picture.data.width;
    info.height = picture.data.height;
    info.beside.clear();  // said when the plate was opened
    info.hasOverscan = false;
    io::WriteOptions options;
    options.outputColorspace = query.colorspace.empty() ? settings.outputColorspace : query.colorspace;
    io::RenderedFrame frame;
    frame.number = picture.frame.number;
    frame.isPlate = picture.frame.isPlate;
    if (picture.isWhole() && picture.frameWidth == plate.width) frame.extras = picture.frame.extras;
    const char* ending = ".exr";
    if (isExr) {
        options.codec = settings.codec;
        options.quality = settings.quality;
        if (settings.floatOutput) options.half = false;
        options.layers = query.wantsLayers();
        frame.beauty = picture.frame.beauty;
        for (const io::Layer& layer : picture.frame.layers)
            if (isWanted(query, layer)) frame.layers.push_back(layer);
    } else {
        ending = format == Format::Png ? ".png" : ".jpg";
        if (format == Format::Jpeg) {
            options.quality = query.quality;
            info.hasAlpha = false;
            frame.isPlate = false;  // encoded anew at the quality asked for
        }
        const io::Layer* const layer = layerShown(picture, query);
        if (layer != nullptr) {
            info.hasAlpha = format == Format::Png;
            frame.extras = nullptr;
            frame.isPlate = false;
        }
        frame.beauty = layer != nullptr ? layer->pixels : picture.frame.beauty;
    }
    const ScratchFile file(ending);
    const Described described(info);
    const auto writer = io::createPlateWriter(file.path(), described, options);
    writer->write(std::move(frame));
    writer->finish();
    return file.content();
}

std::string encodeRaw(const Picture& picture, const io::PlateInfo& plate, const FrameQuery& query)
{
    const Planes planes = planesOf(picture, plate, query);
    std::string bytes(planes.header.bytes(), '\0');
    writeRaw(planes.header, planes.planes, reinterpret_cast<std::byte*>(bytes.data()));
    return bytes;
}

std::unique_ptr<SharedBlock> encodeShared(const Picture& picture, const io::PlateInfo& plate, const FrameQuery& query)
{
    const Planes planes = planesOf(picture, plate, query);
    auto block = std::make_unique<SharedBlock>(planes.header.bytes());
    writeRaw(planes.header, planes.planes, block->data());
    return block;
}

}  // namespace virga::server
