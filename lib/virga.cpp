// The C interface: converts pointers to views, text to settings, and exceptions to codes. No optics here.
#include "virga/virga.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/Error.h"
#include "core/Log.h"
#include "shot/Compositor.h"
#include "shot/Parameters.h"
#include "shot/RenderQueue.h"

using namespace virga;

struct virga_shot {
    std::mutex turn;
    shot::Settings settings;
    shot::Shot shot;
    std::string device = "auto";
    shot::PlateSamples plateSamples;
    bool wantsLayers = false;
    std::string text;  // what virga_shot_get last gave out

    std::shared_ptr<shot::RenderQueue> queue = shot::RenderQueue::ofProcess();
    std::optional<shot::Compositor> compositor;  // lives on the queue's thread; empty when settings have changed

    ~virga_shot() { forgetCompositor(); }
    void forgetCompositor()
    {
        if (compositor) queue->run([this] { compositor.reset(); });
    }
};

namespace {

constexpr int mostPixels = 16384;  // a side: what OpenGL 4.5 promises for textures
thread_local std::string lastSentence;

/// Runs `body`; what it throws becomes a code and the thread's sentence.
template <class Body>
virga_error guarded(const Body& body) noexcept
{
    const auto failed = [](ErrorCode code, const char* sentence) {
        try {
            lastSentence = sentence;
        } catch (const std::bad_alloc&) {
            lastSentence.clear();
        }
        return virga_error(exitCode(code));
    };
    try {
        // Hosts have their own place for messages; standard error is not a library's.
        log::setLevel(log::Level::Quiet);
        body();
        return VIRGA_OK;
    } catch (const Error& error) {
        return failed(error.code(), error.what());
    } catch (const std::bad_alloc&) {
        return failed(ErrorCode::Internal, "out of memory");
    } catch (const std::exception& error) {
        return failed(ErrorCode::Internal, error.what());
    } catch (...) {
        return failed(ErrorCode::Internal, "unknown error");
    }
}

template <class Pointer>
void needs(const Pointer* pointer, const char* name)
{
    if (pointer == nullptr) throw Error(ErrorCode::InvalidArgument, "{}: must not be NULL", name);
}

/// Rows of RGBA floats that the caller owns. The stride may be negative, and bytes need not be a multiple of a pixel.
template <class Float>
class Rows {
public:
    Rows(Float* top, ptrdiff_t stride, const shot::Shot& shot, const char* name)
        : top_(reinterpret_cast<Byte*>(top)), packed_(ptrdiff_t(shot.width) * ptrdiff_t(4 * sizeof(float))),
          stride_(stride != 0 ? stride : packed_)
    {
        needs(top, name);
        if (std::abs(stride_) < packed_)
            throw Error(ErrorCode::InvalidArgument, "{}: a stride of {} bytes is under a row of {} pixels, {} bytes",
                        name, stride, shot.width, packed_);
    }
    auto* row(int y) const { return top_ + y * stride_; }
    std::size_t rowBytes() const { return std::size_t(packed_); }

private:
    using Byte = std::conditional_t<std::is_const_v<Float>, const std::byte, std::byte>;
    Byte* top_;
    ptrdiff_t packed_, stride_;
};

ImageF copyIn(const Rows<const float>& from, const shot::Shot& shot)
{
    ImageF image(shot.width, shot.height, 4);
    for (int y = 0; y < shot.height; ++y) std::memcpy(image.row(y), from.row(y), from.rowBytes());
    return image;
}

void copyOut(const ImageF& image, const Rows<float>& to)
{
    for (int y = 0; y < image.height(); ++y) std::memcpy(to.row(y), image.row(y), to.rowBytes());
}

virga_type typeOf(const shot::Parameter& p)
{
    // In the order of Parameter::member's alternatives.
    constexpr virga_type types[] = {VIRGA_NUMBER, VIRGA_NUMBER_OR_AUTO, VIRGA_WHOLE_NUMBER, VIRGA_SWITCH,
                                    VIRGA_TEXT,   VIRGA_TWO_NUMBERS,    VIRGA_COLOR_OR_AUTO};
    static_assert(std::size(types) == std::variant_size_v<decltype(p.member)>);
    return types[p.member.index()];
}

/// The parameter table with C's types, made once.
struct Table {
    std::vector<std::string> defaults;
    std::vector<virga_parameter> rows;

    Table()
    {
        const shot::Settings settings;
        const auto parameters = shot::parameters();
        for (const shot::Parameter& p : parameters) defaults.push_back(shot::toText(settings, p));
        for (std::size_t i = 0; i < parameters.size(); ++i) {
            const shot::Parameter& p = parameters[i];
            rows.push_back(
                {p.name, p.group, p.unit, typeOf(p), p.least, p.most, defaults[i].c_str(), p.choices, p.help});
        }
    }
};
const Table& table()
{
    static const Table made;
    return made;
}

/// On the shot's thread: a compositor for the settings as they are now.
void makeCompositor(virga_shot& s)
{
    if (!s.settings.gradeFrom.empty() && s.settings.gradeAmount > 0 && s.plateSamples.forGrade.empty())
        throw Error(ErrorCode::InvalidArgument,
                    "grade-from '{}': needs frames of the plate to compare with "
                    "(virga_shot_add_plate_sample)",
                    s.settings.gradeFrom);
    shot::Shot shot = s.shot;
    shot.fps = s.settings.fps.value_or(shot.fps);
    shot.firstFrame = FrameNumber(s.settings.firstFrame.value_or(0));
    shot::CompositorOptions options;
    options.wanted.layers = s.wantsLayers;
    options.device = s.device;
    s.compositor.emplace(s.settings, shot, options, s.plateSamples);
}

ImageF rainLayer(std::vector<io::Layer>& layers, const shot::Shot& shot)
{
    for (io::Layer& layer : layers)
        if (layer.name == "rain" && layer.channels.size() == 4) return std::move(layer.pixels);
    return ImageF(shot.width, shot.height, 4);  // no rain: empty
}

}  // namespace

extern "C" {

const char* virga_error_sentence(void) { return lastSentence.c_str(); }

const char* virga_version(void) { return VIRGA_VERSION; }

size_t virga_parameter_count(void) { return shot::parameters().size(); }

const virga_parameter* virga_parameter_at(size_t index)
{
    const virga_parameter* row = nullptr;
    guarded([&] {
        if (index < table().rows.size()) row = &table().rows[index];
    });
    return row;
}

virga_error virga_shot_create(int width, int height, double frames_per_second, virga_shot** shot)
{
    return guarded([&] {
        needs(shot, "shot");
        *shot = nullptr;
        if (width < 1 || height < 1 || width > mostPixels || height > mostPixels)
            throw Error(ErrorCode::InvalidArgument, "a picture of {} x {}: each side must be 1 to {} pixels", width,
                        height, mostPixels);
        if (!(frames_per_second > 0) || std::isinf(frames_per_second))
            throw Error(ErrorCode::InvalidArgument, "{} frames a second: must be over 0", frames_per_second);
        auto made = std::make_unique<virga_shot>();
        made->shot = {width, height, frames_per_second, 0};
        *shot = made.release();
    });
}

void virga_shot_release(virga_shot* shot)
{
    guarded([&] { delete shot; });
}

virga_error virga_shot_set(virga_shot* shot, const char* name, const char* text)
{
    return guarded([&] {
        needs(shot, "shot"), needs(name, "name"), needs(text, "text");
        const std::lock_guard turn(shot->turn);
        shot::setFromText(shot->settings, shot::findParameter(name), text);
        shot->forgetCompositor();
    });
}

virga_error virga_shot_get(virga_shot* shot, const char* name, const char** text)
{
    return guarded([&] {
        needs(shot, "shot"), needs(name, "name"), needs(text, "text");
        const std::lock_guard turn(shot->turn);
        shot->text = shot::toText(shot->settings, shot::findParameter(name));
        *text = shot->text.c_str();
    });
}

virga_error virga_shot_set_device(virga_shot* shot, const char* device)
{
    return guarded([&] {
        needs(shot, "shot"), needs(device, "device");
        const std::lock_guard turn(shot->turn);
        shot->device = device;
        shot->forgetCompositor();
    });
}

virga_error virga_shot_add_plate_sample(virga_shot* shot, const float* plate, ptrdiff_t plate_stride)
{
    return guarded([&] {
        needs(shot, "shot");
        const std::lock_guard turn(shot->turn);
        shot->plateSamples.forGrade.push_back(copyIn({plate, plate_stride, shot->shot, "plate"}, shot->shot));
        shot->forgetCompositor();
    });
}

virga_error virga_shot_is_identity(virga_shot* shot, int* is_identity)
{
    return guarded([&] {
        needs(shot, "shot"), needs(is_identity, "is_identity");
        const std::lock_guard turn(shot->turn);
        *is_identity = shot::planFrame(shot->settings, {}, false).isPassThrough();
    });
}

virga_error virga_shot_render(virga_shot* shot, int64_t frame, const float* plate, ptrdiff_t plate_stride,
                              float* beauty, ptrdiff_t beauty_stride, float* rain, ptrdiff_t rain_stride)
{
    return guarded([&] {
        needs(shot, "shot");
        const Rows<const float> in(plate, plate_stride, shot->shot, "plate");
        const Rows<float> out(beauty, beauty_stride, shot->shot, "beauty");
        std::optional<Rows<float>> layer;
        if (rain != nullptr) layer.emplace(rain, rain_stride, shot->shot, "rain");

        const std::lock_guard turn(shot->turn);
        if (layer && !shot->wantsLayers) {  // once asked for, kept: hosts ask for the same again
            shot->forgetCompositor();
            shot->wantsLayers = true;
        }
        io::RenderedFrame rendered;
        shot->queue->run([&] {
            if (!shot->compositor) makeCompositor(*shot);
            io::PlateFrame source;
            source.number = frame;
            source.pixels = copyIn(in, shot->shot);
            rendered = shot->compositor->render(std::move(source));
        });
        copyOut(rendered.beauty, out);
        if (layer) copyOut(rainLayer(rendered.layers, shot->shot), *layer);
    });
}

}  // extern "C"
