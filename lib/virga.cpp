// The C interface: pointers checked, calls handed on, exceptions made codes. No optics here, and no pixels.
#include "virga/virga.h"

#include <algorithm>
#include <cstring>
#include <memory>

#include "Errors.h"
#include "Shot.h"
#include "Table.h"
#include "core/Counters.h"
#include "core/Error.h"
#include "core/Log.h"
#include "shot/Parameters.h"
#include "shot/SettingsText.h"

using namespace virga;
using lib::needs;

struct virga_shot {
    std::shared_ptr<lib::Shot> shot;
};

namespace {

/// Runs body(shot) for a caller's shot; calls that are under way when it is released end well.
template <class Body>
virga_error onShot(virga_shot* given, const Body& body) noexcept
{
    if (given == nullptr) return lib::guarded(nullptr, [] { needs(nullptr, "shot"); });
    const std::shared_ptr<lib::Shot> shot = given->shot;
    return lib::guarded(&shot->failure(), [&] { body(*shot); });
}

/// As many of them as there is room for.
template <class From, class To>
void giveOut(const From& from, To* to, size_t capacity, size_t* count)
{
    *count = from.size();
    std::copy_n(from.begin(), std::min(capacity, from.size()), to);
}

}  // namespace

extern "C" {

const char* virga_error_sentence(void) { return lib::failureOfThread().sentence.c_str(); }

virga_error virga_shot_error(virga_shot* shot, const char** sentence)
{
    if (shot != nullptr) return shot->shot->failure().take(sentence);
    thread_local lib::Failure given;
    given = std::exchange(lib::failureOfThread(), {});
    if (sentence != nullptr) *sentence = given.sentence.c_str();
    return given.code;
}

const char* virga_version(void) { return VIRGA_VERSION; }

size_t virga_parameter_count(void) { return shot::parameters().size(); }

const virga_parameter* virga_parameter_at(size_t index)
{
    const virga_parameter* row = nullptr;
    lib::guarded(nullptr, [&] {
        const auto rows = lib::table();
        if (index < rows.size()) row = &rows[index];
    });
    return row;
}

virga_error virga_shot_create(int width, int height, double frames_per_second, virga_shot** shot)
{
    return lib::guarded(nullptr, [&] {
        needs(shot, "shot");
        *shot = nullptr;
        // Hosts have their own place for messages; standard error is not a library's.
        log::setLevel(log::Level::Quiet);
        auto made = std::make_unique<virga_shot>();
        made->shot = std::make_shared<lib::Shot>(width, height, frames_per_second);
        *shot = made.release();
    });
}

void virga_shot_release(virga_shot* shot)
{
    if (shot == nullptr) return;
    lib::guarded(nullptr, [&] {
        shot->shot->cancel();
        delete shot;
    });
}

virga_error virga_shot_set(virga_shot* shot, const char* name, const char* text)
{
    return onShot(shot, [&](lib::Shot& s) {
        needs(name, "name"), needs(text, "text");
        s.change([&](shot::Settings& settings) { shot::setFromText(settings, shot::findParameter(name), text); });
    });
}

virga_error virga_shot_set_numbers(virga_shot* shot, const char* name, const double* values, size_t count)
{
    return onShot(shot, [&](lib::Shot& s) {
        needs(name, "name");
        if (count > 0) needs(values, "values");
        s.change([&](shot::Settings& settings) {
            lib::setFromNumbers(settings, shot::findParameter(name), {values, count});
        });
    });
}

virga_error virga_shot_set_document(virga_shot* shot, const char* text)
{
    return onShot(shot, [&](lib::Shot& s) {
        needs(text, "text");
        s.change([&](shot::Settings& settings) { shot::applySettingsText(settings, text, "settings"); });
    });
}

virga_error virga_shot_get(virga_shot* shot, const char* name, const char** text)
{
    return onShot(shot, [&](lib::Shot& s) {
        needs(name, "name"), needs(text, "text");
        *text = s.keep(lib::Shot::Text::Value, shot::toText(s.settings(), shot::findParameter(name)));
    });
}

virga_error virga_shot_get_numbers(virga_shot* shot, const char* name, double* values, size_t capacity, size_t* count)
{
    return onShot(shot, [&](lib::Shot& s) {
        needs(name, "name"), needs(count, "count");
        if (capacity > 0) needs(values, "values");
        giveOut(lib::numbersOf(s.settings(), shot::findParameter(name)), values, capacity, count);
    });
}

virga_error virga_shot_get_document(virga_shot* shot, virga_document kind, const char** text)
{
    return onShot(shot, [&](lib::Shot& s) {
        needs(text, "text");
        const int number = lib::numberIn(kind);
        if (number != VIRGA_TOML && number != VIRGA_JSON)
            throw Error(ErrorCode::InvalidArgument, "kind is {}; must be one of virga_document", number);
        const shot::Settings settings = s.settings();
        *text = s.keep(lib::Shot::Text::Document,
                       number == VIRGA_JSON ? shot::settingsAsJson(settings) : shot::settingsAsToml(settings));
    });
}

virga_error virga_shot_set_device(virga_shot* shot, const char* device)
{
    return onShot(shot, [&](lib::Shot& s) {
        needs(device, "device");
        s.setDevice(device);
    });
}

virga_error virga_shot_device(virga_shot* shot, const char** text)
{
    return onShot(shot, [&](lib::Shot& s) {
        needs(text, "text");
        *text = s.keep(lib::Shot::Text::Device, s.device());
    });
}

virga_error virga_shot_add_plate_sample(virga_shot* shot, int64_t frame, const virga_picture* plate)
{
    return onShot(shot, [&](lib::Shot& s) { s.addSample(frame, plate); });
}

virga_error virga_shot_clear_plate_samples(virga_shot* shot)
{
    return onShot(shot, [](lib::Shot& s) { s.clearSamples(); });
}

virga_error virga_shot_samples_wanted(virga_shot* shot, int64_t first, int64_t last, int64_t* frames, size_t capacity,
                                      size_t* count)
{
    return onShot(shot, [&](lib::Shot& s) {
        needs(count, "count");
        if (capacity > 0) needs(frames, "frames");
        giveOut(s.samplesWanted(first, last), frames, capacity, count);
    });
}

virga_error virga_shot_set_environment(virga_shot* shot, const virga_picture* panorama)
{
    return onShot(shot, [&](lib::Shot& s) { s.setEnvironment(panorama); });
}

virga_error virga_shot_is_identity(virga_shot* shot, int* is_identity)
{
    return onShot(shot, [&](lib::Shot& s) {
        needs(is_identity, "is_identity");
        *is_identity = s.isIdentity() ? 1 : 0;
    });
}

virga_error virga_shot_frame_size(virga_shot* shot, double scale, int* width, int* height)
{
    return onShot(shot, [&](lib::Shot& s) {
        needs(width, "width"), needs(height, "height");
        const Window frame = s.frameAt(scale);
        *width = frame.width;
        *height = frame.height;
    });
}

virga_error virga_shot_plate_needed(virga_shot* shot, const virga_request* request, virga_window* plate)
{
    return onShot(shot, [&](lib::Shot& s) {
        needs(plate, "plate");
        const Window needed = s.plateNeeded(request);
        *plate = {needed.x, needed.y, needed.width, needed.height};
    });
}

virga_error virga_shot_render(virga_shot* shot, const virga_request* request)
{
    return onShot(shot, [&](lib::Shot& s) { s.render(request); });
}

virga_error virga_shot_cancel(virga_shot* shot)
{
    return onShot(shot, [](lib::Shot& s) { s.cancel(); });
}

virga_error virga_counter(const char* name, uint64_t* value)
{
    return lib::guarded(nullptr, [&] {
        needs(name, "name"), needs(value, "value");
        const Counters& all = counters();
        const std::pair<const char*, const std::atomic<std::uint64_t>&> named[] = {{"frames", all.frames},
                                                                                   {"contexts", all.contexts},
                                                                                   {"programs", all.programs},
                                                                                   {"environments", all.environments}};
        for (const auto& [word, count] : named)
            if (std::strcmp(name, word) == 0) {
                *value = count;
                return;
            }
        throw Error(ErrorCode::InvalidArgument,
                    "no counter is called '{}': must be frames, contexts, programs or environments", name);
    });
}

}  // extern "C"
