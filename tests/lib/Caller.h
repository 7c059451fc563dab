// What a caller of the C interface does, in C++: shots that go by themselves, pictures of every format, plain frames.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "virga/virga.h"

namespace virga::test {

struct Release {
    void operator()(virga_shot* shot) const { virga_shot_release(shot); }
};
using ShotPointer = std::unique_ptr<virga_shot, Release>;

/// Dense, light rain that draws in a moment, by the processor.
inline ShotPointer smallShot(int width = 64, int height = 48, const char* device = "cpu")
{
    virga_shot* shot = nullptr;
    EXPECT_EQ(virga_shot_create(width, height, 24, &shot), VIRGA_OK) << virga_error_sentence();
    EXPECT_EQ(virga_shot_set_device(shot, device), VIRGA_OK);
    EXPECT_EQ(virga_shot_set(shot, "rate", "80"), VIRGA_OK);
    EXPECT_EQ(virga_shot_set(shot, "exposure", "0.01"), VIRGA_OK);
    return ShotPointer(shot);
}

inline void switchOff(virga_shot* shot)
{
    for (const char* name : {"rate", "fog", "darken", "desaturate", "blur", "splashes"})
        EXPECT_EQ(virga_shot_set(shot, name, "0"), VIRGA_OK);
}

/// Memory for a picture, and the description of it.
class Frame {
public:
    Frame(int width, int height, virga_layout layout = VIRGA_RGBA, virga_samples samples = VIRGA_FLOAT, int bits = 0,
          bool hasAlphaPlane = false)
        : width_(width), height_(height)
    {
        picture.layout = layout;
        picture.samples = samples;
        picture.significant_bits = bits;
        picture.window = {0, 0, width, height};
        const bool isYuv = layout >= VIRGA_YUV420;
        const int planes = layout == VIRGA_RGBA_PLANES || isYuv ? (hasAlphaPlane ? 4 : 3) : 1;
        const int channels = layout == VIRGA_RGBA || layout == VIRGA_BGRA ? 4 : layout == VIRGA_RGB ? 3 : 1;
        const std::size_t bytes = samples == VIRGA_FLOAT ? 4 : samples == VIRGA_UINT8 ? 1 : 2;
        for (int k = 0; k < planes; ++k) {
            const bool isShared = isYuv && (k == 1 || k == 2);
            const int columns = isShared && layout != VIRGA_YUV444 ? (width + 1) / 2 : width;
            const int rows = isShared && layout == VIRGA_YUV420 ? (height + 1) / 2 : height;
            planes_.emplace_back(std::size_t(columns) * std::size_t(rows) * std::size_t(channels) * bytes);
        }
        for (int k = 0; k < planes; ++k) picture.planes[k] = planes_[std::size_t(k)].data();
    }
    Frame(const Frame&) = delete;
    Frame& operator=(const Frame&) = delete;

    int width() const { return width_; }
    int height() const { return height_; }
    std::vector<std::byte>& plane(int k) { return planes_[std::size_t(k)]; }
    const std::vector<std::vector<std::byte>>& planes() const { return planes_; }
    /// Of float pictures of one plane.
    float* floats() { return reinterpret_cast<float*>(planes_[0].data()); }
    const float* floats() const { return reinterpret_cast<const float*>(planes_[0].data()); }
    std::size_t size() const { return planes_[0].size() / sizeof(float); }
    /// RGBA float.
    const float* pixel(int x, int y) const { return floats() + 4 * (y * width_ + x); }

    virga_picture picture = virga_picture_default();

private:
    int width_, height_;
    std::vector<std::vector<std::byte>> planes_;
};

/// A street of sorts: light above, dark below, in steps; opaque.
inline void paint(Frame& frame)
{
    for (int y = 0; y < frame.height(); ++y)
        for (int x = 0; x < frame.width(); ++x) {
            float* p = frame.floats() + 4 * (y * frame.width() + x);
            const float sky = 0.6f * float(frame.height() - y) / float(frame.height());
            for (int c = 0; c < 3; ++c) p[c] = 0.05f + sky + 0.2f * float((x / 5 + y / 7 + c) % 4) / 4;
            p[3] = 1;
        }
}

inline virga_error render(virga_shot* shot, std::int64_t number, Frame& plate, Frame& beauty)
{
    virga_request request = virga_request_default();
    request.frame = double(number);
    request.plate = &plate.picture;
    request.beauty = &beauty.picture;
    return virga_shot_render(shot, &request);
}

/// The greatest difference of two float pictures of a size.
inline float farthest(const Frame& a, const Frame& b)
{
    float most = 0;
    for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a.floats()[i] - b.floats()[i]));
    return most;
}

inline std::uint64_t count(const char* name)
{
    std::uint64_t value = 0;
    EXPECT_EQ(virga_counter(name, &value), VIRGA_OK);
    return value;
}

}  // namespace virga::test
