// `virga bench e2e`: the whole command on a movie, from start to the last byte, against a plain ffmpeg transcode of the
// same movie with the same codec settings. Both run in turn, so that a busy machine is busy for both.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace virga::bench {

struct EndToEndOptions {
    std::string movie;
    std::string out;  ///< folder that keeps both movies (plain.*, rain.*); empty: neither is kept
    std::string codec = "libx264";
    double quality = 18;                 ///< CRF of both
    int runs = 3;                        ///< of each; medians count
    std::vector<std::string> rainFlags;  ///< more flags of `virga rain`
    std::string device = "auto";
    std::string virga;  ///< the program
};

/// Seconds, medians.
struct EndToEndTime {
    double seconds = 0, processors = 0;
};

struct EndToEndReport {
    std::size_t frames = 0;
    EndToEndTime decode;                      ///< ffmpeg reading the movie and writing nothing
    EndToEndTime plain;                       ///< ffmpeg's transcode
    EndToEndTime rain;                        ///< virga rain
    double startSeconds = 0;                  ///< of virga rain, before the first frame is read
    double render_ms = 0;                     ///< a frame, without waiting for reader and writer
    std::map<std::string, double> passes_ms;  ///< what virga rain says of it, a frame
    double strokes = 0;                       ///< a frame
    std::string device;

    double ratio() const { return rain.seconds / plain.seconds; }
    double processorRatio() const { return rain.processors / plain.processors; }
};

/// Throws Error(InvalidArgument) for a codec without CRF, Error(Input) if ffmpeg or virga fails, with what it says,
/// Error(Output).
EndToEndReport runEndToEnd(const EndToEndOptions& options);

std::string endToEndText(const EndToEndReport& report);
nlohmann::ordered_json endToEndJson(const EndToEndReport& report);

}  // namespace virga::bench
