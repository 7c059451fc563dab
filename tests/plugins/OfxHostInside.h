// What the files of the host share: who acts, what lives, what an image is.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "OfxHost.h"

namespace virga::test::inside {

extern OfxHostOfTests* current;          // hosts are used one at a time
extern thread_local HostEffect* acting;  // whose action this thread runs; null: none
extern thread_local std::string action;  // its name

std::mutex& mutexOfHost();
void misuse(const std::string& what);
bool isLiving(const void* object);
void bear(const void* object);
void bury(const void* object);

/// The standard's type of a property of that set: 'i' whole, 'd' double, 's' string, 'p' pointer; 0: it has none such.
char typeOf(const PropertySet& set, const std::string& property);
bool isParameterType(const std::string& type);

const void* fetchSuite(OfxPropertySetHandle host, const char* name, int version);

}  // namespace virga::test::inside

namespace virga::test {

struct HostImage {
    PropertySet set{"image"};
    OfxRectI bounds{};
    std::vector<std::byte> memory;
    std::ptrdiff_t rowBytes = 0;
    std::byte* bottom = nullptr;
    int channels = 4;
    std::string depth;

    std::size_t sampleBytes() const
    {
        return depth == ofx::value::depthFloat ? 4 : depth == ofx::value::depthByte ? 1 : 2;
    }
    std::byte* sample(int x, int y, int channel)
    {
        return bottom + std::ptrdiff_t(y - bounds.y1) * rowBytes +
               (std::ptrdiff_t(x - bounds.x1) * channels + channel) * std::ptrdiff_t(sampleBytes());
    }
    void write(int x, int y, int channel, float v)
    {
        std::byte* to = sample(x, y, channel);
        if (depth == ofx::value::depthFloat) {
            std::memcpy(to, &v, 4);
        } else if (depth == ofx::value::depthHalf) {
            const _Float16 half = _Float16(v);
            std::memcpy(to, &half, 2);
        } else if (depth == ofx::value::depthShort) {
            const auto code = std::uint16_t(std::lround(std::clamp(v, 0.0F, 1.0F) * 65535));
            std::memcpy(to, &code, 2);
        } else {
            *to = std::byte(std::lround(std::clamp(v, 0.0F, 1.0F) * 255));
        }
    }
    float read(int x, int y, int channel)
    {
        const std::byte* from = sample(x, y, channel);
        if (depth == ofx::value::depthFloat) {
            float v = 0;
            std::memcpy(&v, from, 4);
            return v;
        }
        if (depth == ofx::value::depthHalf) {
            _Float16 half = 0;
            std::memcpy(&half, from, 2);
            return float(half);
        }
        if (depth == ofx::value::depthShort) {
            std::uint16_t code = 0;
            std::memcpy(&code, from, 2);
            return float(code) / 65535;
        }
        return float(*from) / 255;
    }
    void lay(const HostClip& clip, const OfxRectI& where)
    {
        bounds = where;
        depth = clip.depth;
        channels = clip.components == ofx::value::componentRgba  ? 4
                   : clip.components == ofx::value::componentRgb ? 3
                                                                 : 1;
        const std::size_t row =
            std::size_t(bounds.x2 - bounds.x1) * std::size_t(channels) * sampleBytes() + std::size_t(clip.spareBytes);
        const std::size_t rows = std::size_t(bounds.y2 - bounds.y1);
        memory.assign(row * rows, std::byte(0xa5));
        rowBytes = clip.rowsGoDown ? -std::ptrdiff_t(row) : std::ptrdiff_t(row);
        bottom = clip.rowsGoDown && rows > 0 ? memory.data() + row * (rows - 1) : memory.data();
        set.put(ofx::prop::data, {static_cast<void*>(bottom)});
        set.put(ofx::prop::bounds, {bounds.x1, bounds.y1, bounds.x2, bounds.y2});
        set.put(ofx::prop::rowBytes, {int(rowBytes)});
        set.put(ofx::prop::pixelDepth, {clip.depth});
        set.put(ofx::prop::components, {clip.components});
        set.put(ofx::prop::preMultiplication, {clip.alpha});
    }
};

namespace inside {

/// What the action under way on this thread is about.
struct ActionState {
    double time = 0, scale = 1;
    OfxRectI window{};
    std::vector<std::unique_ptr<HostImage>> images;
    std::unique_ptr<HostImage> output;
    bool outputIsReleased = false;
};
extern thread_local ActionState state;

}  // namespace inside

}  // namespace virga::test
