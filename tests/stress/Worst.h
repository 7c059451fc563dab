// One frame of a shot at its worst: what the tests by name change and render.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "core/Log.h"
#include "shot/Compositor.h"
#include "stress/Laws.h"
#include "support/Files.h"

namespace virga::stress {

/// One frame of a shot; rain that the eye sees, each stroke of it drawn, lit by a grey world, unless a test changes it.
struct Worst {
    Worst()
    {
        settings.thin = 0;
        settings.threshold = 1e-3;  // hundreds of strokes in so small a frame, whatever the seed
    }

    shot::Settings settings;
    shot::Shot shot{33, 17, 24, 0};
    FrameNumber frame = 0;
    bool layers = true, isOpaque = true;
    float plate = 0.5f, alpha = 1;
    Ceiling ceiling{.light = 0.5};

    std::string device = "cpu";
    shot::CompositorStatistics statistics{};

    /// The frame, in which every law has to hold.
    io::RenderedFrame render()
    {
        log::setLevel(log::Level::Quiet);
        shot::Compositor compositor(settings, shot,
                                    {.wanted = {.layers = layers}, .device = device, .shaderFolder = {}}, {});
        io::PlateFrame in;
        in.number = frame;
        in.pixels = ImageF(shot.width, shot.height, 4, plate);
        for (int y = 0; y < shot.height; ++y)
            for (int x = 0; x < shot.width; ++x) in.pixels.at(x, y, 3) = alpha;
        io::RenderedFrame out = compositor.render(std::move(in));
        statistics = compositor.statistics();
        EXPECT_EQ(brokenLaw(out, ceiling, isOpaque), "");
        return out;
    }

    /// Lawful, or refused in a sentence.
    bool isRendered()
    {
        try {
            render();
            return true;
        } catch (const Error& error) {
            EXPECT_EQ(int(error.code()), int(ErrorCode::InvalidArgument)) << error.what();
            return false;
        }
    }
};

}  // namespace virga::stress
