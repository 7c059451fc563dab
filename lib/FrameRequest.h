// What is asked of a shot for one frame, checked.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "Picture.h"
#include "core/FrameRange.h"
#include "shot/View.h"

namespace virga::lib {

struct FrameRequest {
    /// width, height: of the frame at scale 1. needsPictures: it is to be rendered, not only talked about. Throws
    /// Error(InvalidArgument) naming the field or picture.
    FrameRequest(const virga_request* given, int width, int height, bool needsPictures);

    /// Pictures that are written, by the layers' names; "" is the beauty.
    struct Output {
        const char* layer;
        Picture picture;
    };

    FrameNumber number = 0;
    double later = 0;  ///< the shutter opens so many frames after it begins, 0 to under 1
    double scale = 1;
    Window frame, region;  ///< at the scale
    std::optional<Picture> plate, depth;
    std::vector<Output> outputs;
    virga_progress progress = nullptr;
    void* user = nullptr;
    int priority = 0;
    std::uint64_t plateContent = 0;

    bool wantsLayers() const;
    const Picture* beauty() const;  ///< null: it is not wanted
    /// Of the region; `plate` is what will be given of it.
    shot::View view(const Window& plate) const;
};

}  // namespace virga::lib
