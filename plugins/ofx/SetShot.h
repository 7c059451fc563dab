// A shot of libvirga, and which values it was given last, so that only what changed is set.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "virga/virga.h"

namespace virga::ofxplugin {

class SetShot {
public:
    /// Throws Failure.
    SetShot(int width, int height, double fps);

    /// One text a row of panel(). Throws Failure with the library's sentence; what was set before that row stays set.
    void set(const std::vector<std::string>& texts);
    virga_shot* get() const { return shot_.get(); }
    bool is(int width, int height, double fps) const { return width == width_ && height == height_ && fps == fps_; }

    std::map<std::int64_t, std::size_t> sampled;  ///< frames given as samples, and what their pixels hash to
    std::string environment;                      ///< what tells the panorama that it has from others; "": it has none

private:
    struct Release {
        void operator()(virga_shot* shot) const { virga_shot_release(shot); }
    };
    int width_, height_;
    double fps_;
    std::unique_ptr<virga_shot, Release> shot_;
    std::vector<std::string> texts_;
};

/// Throws Failure with the library's sentence unless `code` is VIRGA_OK.
void needs(virga_error code);

}  // namespace virga::ofxplugin
