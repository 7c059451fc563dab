// The entry points of the filter for frei0r hosts (ffmpeg, melt, Kdenlive, Shotcut, Flowblade, GStreamer).
#include <dlfcn.h>

#include <cstdio>
#include <cstring>
#include <exception>

#include "Controls.h"
#include "Filter.h"
#include "Frei0rAbi.h"

using namespace virga::frei0r;

namespace {

/// frei0r asks for seconds; libavfilter, alone, counts milliseconds. Who calls is seen from where the call came from.
double unitOf(const void* caller)
{
    Dl_info from{};
    if (dladdr(caller, &from) == 0 || from.dli_fname == nullptr) return seconds;
    const char* const slash = std::strrchr(from.dli_fname, '/');
    const char* const file = slash != nullptr ? slash + 1 : from.dli_fname;
    for (const char* name : {"libavfilter", "ffmpeg", "ffplay", "ffprobe", "mpv"})
        if (std::strncmp(file, name, std::strlen(name)) == 0) return milliseconds;
    return seconds;
}

}  // namespace

int f0r_init() { return 1; }

void f0r_deinit() {}

void f0r_get_plugin_info(f0r_plugin_info* info)
{
    int major = 0, minor = 0;
    std::sscanf(virga_version(), "%d.%d", &major, &minor);
    *info = {"virga",
             "The Virga authors",
             frei0rFilter,
             frei0rRgba8888,
             frei0rVersion,
             major,
             minor,
             int(controls().size()),
             "Rain into filmed footage: strokes by the physics of falling drops, lit by each frame itself"};
}

void f0r_get_param_info(f0r_param_info* info, int index)
{
    if (index < 0 || index >= int(controls().size())) return;
    const Control& control = controls()[std::size_t(index)];
    *info = {control.name, index == settings ? frei0rString : frei0rDouble, control.explanation};
}

void* f0r_construct(unsigned int width, unsigned int height)
{
    try {
        return new Filter(int(width), int(height));
    } catch (...) {
        return nullptr;
    }
}

void f0r_destruct(void* instance) { delete static_cast<Filter*>(instance); }

void f0r_set_param_value(void* instance, void* value, int index)
{
    if (instance == nullptr || value == nullptr) return;
    try {
        if (index == settings)
            static_cast<Filter*>(instance)->set(index, *static_cast<char**>(value));
        else
            static_cast<Filter*>(instance)->set(index, *static_cast<double*>(value));
    } catch (const std::exception& error) {
        std::fprintf(stderr, "virga: %s\n", error.what());
    }
}

void f0r_get_param_value(void* instance, void* value, int index)
{
    if (instance == nullptr || value == nullptr) return;
    if (index == settings)
        *static_cast<const char**>(value) = static_cast<Filter*>(instance)->text(index);
    else
        *static_cast<double*>(value) = static_cast<Filter*>(instance)->number(index);
}

void f0r_update(void* instance, double time, const std::uint32_t* in, std::uint32_t* out)
{
    if (instance == nullptr) return;
    const double unit = unitOf(__builtin_return_address(0));
    try {
        static_cast<Filter*>(instance)->update(time, unit, in, out);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "virga: %s\n", error.what());
    }
}
