// The C interface between frei0r hosts and filters, as far as Virga uses it. Source: the frei0r plug-in API
// specification, version 1.2 (frei0r.dyne.org, "API documentation"). Values and the order of members are the interface.
#pragma once

#include <cstdint>

inline constexpr int frei0rVersion = 1;
inline constexpr int frei0rFilter = 0;                    // plugin_type
inline constexpr int frei0rRgba8888 = 1;                  // color_model: bytes R, G, B, A
inline constexpr int frei0rDouble = 1, frei0rString = 4;  // types of parameters; doubles are 0 to 1

struct f0r_plugin_info {
    const char *name, *author;
    int plugin_type, color_model, frei0r_version, major_version, minor_version, num_params;
    const char* explanation;
};

struct f0r_param_info {
    const char* name;
    int type;
    const char* explanation;
};

#define VIRGA_FREI0R extern "C" __attribute__((visibility("default")))

VIRGA_FREI0R int f0r_init();
VIRGA_FREI0R void f0r_deinit();
VIRGA_FREI0R void f0r_get_plugin_info(f0r_plugin_info* info);
VIRGA_FREI0R void f0r_get_param_info(f0r_param_info* info, int index);
VIRGA_FREI0R void* f0r_construct(unsigned int width, unsigned int height);
VIRGA_FREI0R void f0r_destruct(void* instance);
VIRGA_FREI0R void f0r_set_param_value(void* instance, void* value, int index);
VIRGA_FREI0R void f0r_get_param_value(void* instance, void* value, int index);
/// time in seconds. Frames are width x height packed pixels, top row first.
VIRGA_FREI0R void f0r_update(void* instance, double time, const std::uint32_t* in, std::uint32_t* out);
