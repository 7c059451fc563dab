// A shot with a plate, and a request for frame 0 of it.
#pragma once

#include "Caller.h"

namespace virga::test {

inline constexpr int width = 96, height = 64;

class FrameTest : public testing::Test {
protected:
    FrameTest() : shot(smallShot(width, height)), plate(width, height), beauty(width, height), again(width, height)
    {
        paint(plate);
        request.plate = &plate.picture;
        request.beauty = &beauty.picture;
    }
    void set(const char* name, const char* text)
    {
        ASSERT_EQ(virga_shot_set(shot.get(), name, text), VIRGA_OK) << virga_error_sentence();
    }
    virga_error go() { return virga_shot_render(shot.get(), &request); }

    ShotPointer shot;
    Frame plate, beauty, again;
    virga_request request = virga_request_default();
};

}  // namespace virga::test
