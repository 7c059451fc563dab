// One instance of the filter: frames of one size, each the same whenever it is asked for.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "Controls.h"
#include "virga/virga.h"

namespace virga::frei0r {

/// What one unit of the host's time is, in seconds.
inline constexpr double seconds = 1, milliseconds = 1e-3;

/// Calls take turns; instances do not wait for each other but where the library does.
class Filter {
public:
    Filter(int width, int height) : width_(width), height_(height) {}

    void set(int index, double value);
    void set(int index, const char* text);
    double number(int index) const;
    const char* text(int index) const;  ///< lives until the text is set again

    /// `unit`: what the caller is known to count in, unless `time` says otherwise. What cannot be rendered is said
    /// once, on standard error, and the frame comes out as it went in: frei0r has no word for failure.
    void update(double time, double unit, const std::uint32_t* in, std::uint32_t* out);

private:
    struct Release {
        void operator()(virga_shot* shot) const { virga_shot_release(shot); }
    };
    virga_error prepare();
    void complain(const std::string& sentence);

    int width_, height_;
    mutable std::mutex turn_;
    std::array<double, 9> values_ = [] {
        std::array<double, 9> starts{};
        for (std::size_t i = 0; i < starts.size(); ++i) starts[i] = controls()[i].start;
        return starts;
    }();
    std::string settings_, said_;
    std::unique_ptr<virga_shot, Release> shot_;  // empty when something has been set
};

}  // namespace virga::frei0r
