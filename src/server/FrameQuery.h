// What a request for a frame asks for, out of its query and its Accept; docs/server.md has the table.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/FrameRange.h"
#include "core/Window.h"
#include "shot/Settings.h"
#include "shot/View.h"

namespace virga::server {

/// Names and values after the '?', decoded, in their order.
using Query = std::vector<std::pair<std::string, std::string>>;
/// "a=1&b=%20+" decoded. Throws Refusal 400 for a broken escape, a control character, or more than 200 of them.
Query parseQuery(std::string_view text);
/// "%2F" and the like made plain. plus: a '+' is a space. Throws Refusal 400.
std::string decoded(std::string_view text, bool plus);

enum class Format { Exr, Png, Jpeg, Raw, Shared };
constexpr const char* rawType = "application/x-virga-raw";
constexpr const char* sharedType = "application/x-virga-shm";
const char* typeOf(Format format) noexcept;

/// The weightiest of the formats that Accept (RFC 9110, 12.5.1) names; of equal ones, and for */*, in the order PNG,
/// JPEG, EXR, raw. Shared memory must be named. Throws Refusal 406 if none is.
Format chooseFormat(std::string_view accept);

struct FrameQuery {
    FrameNumber frame = 0;         ///< of rain, camera, depth, and of the plate unless `time_s` says otherwise
    std::optional<double> time_s;  ///< the plate's frame is the one shown at this time from its start
    shot::View view;               ///< region in pixels of the frame at the scale; empty: whole
    Window dataWindow{};           ///< where the plate has pixels, at scale 1; beyond it is nothing. Empty: everywhere
    std::vector<std::string> layers;  ///< "beauty", "rain", ...; empty: beauty alone
    std::string colorspace;           ///< of the answer; empty: see docs/server.md
    bool isFloat = false;             ///< samples of raw and shared memory; else half
    int quality = 95;                 ///< of JPEG
    std::string viewer;               ///< whose newer requests overtake the older; empty: nobody's
    int priority = 0;                 ///< -100 to 100, the greatest first
    std::vector<std::pair<std::string, std::string>> changes;  ///< of parameters, for this frame alone

    bool wants(std::string_view layer) const;
    /// Whether layers besides the beauty are asked for.
    bool wantsLayers() const;
};

/// Throws Refusal 400 naming the word, the value and what is allowed; also for words that nobody knows.
FrameQuery parseFrameQuery(FrameNumber frame, const Query& query);

/// "x,y,w,h": x and y within +-65536, w and h 1 to 16384. Throws Refusal 400.
Window parseWindow(const char* name, std::string_view text);
/// Throws Refusal 400 unless the text is a whole number.
FrameNumber parseFrameNumber(std::string_view text);

}  // namespace virga::server
