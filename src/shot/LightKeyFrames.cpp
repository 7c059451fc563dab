#include "shot/LightKeyFrames.h"

#include <algorithm>

#include "core/Error.h"
#include "core/Parallel.h"
#include "io/Plate.h"
#include "sh/Panorama.h"

namespace virga::shot {
namespace {

/// (1 - t) a + t b at the size of the larger: maps follow their environment's order.
ImageF mixed(const ImageF& a, const ImageF& b, float t)
{
    const int width = std::max(a.width(), b.width()), height = std::max(a.height(), b.height());
    ImageF result(width, height, 3);
    const bool sameSize = a.width() == b.width() && a.height() == b.height();
    parallelFor(0, height, 8, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y) {
            float* to = result.row(y);
            if (sameSize) {
                for (int i = 0; i < 3 * width; ++i) to[i] = (1 - t) * a.row(y)[i] + t * b.row(y)[i];
                continue;
            }
            for (int x = 0; x < width; ++x, to += 3) {
                const glm::dvec3 direction = sh::panoramaDirection(x + 0.5, y + 0.5, width, height);
                const glm::dvec3 value = double(1 - t) * environment::sampleMap(a, direction) +
                                         double(t) * environment::sampleMap(b, direction);
                for (int c = 0; c < 3; ++c) to[c] = float(value[c]);
            }
        }
    });
    return result;
}

}  // namespace

LightKeyFrames::LightKeyFrames(const std::string& pattern, Read read)
    : pattern_(pattern), read_(std::move(read)), frames_(io::findFrames(pattern))
{
    if (frames_.empty()) throw Error(ErrorCode::Input, "environment '{}': no frame of that pattern exists", pattern);
}

const LightKeyFrames::Key& LightKeyFrames::key(FrameNumber number)
{
    const auto found = std::find_if(keys_.begin(), keys_.end(), [&](const Key& k) { return k.number == number; });
    return found != keys_.end() ? *found : keys_.emplace_back(Key{number, read_(io::framePath(pattern_, number))});
}

bool LightKeyFrames::moveTo(FrameNumber frame, environment::DropRadiance& light)
{
    const FrameNumber held = std::clamp(frame, frames_.front(), frames_.back());
    const auto after = std::lower_bound(frames_.begin(), frames_.end(), held);
    const FrameNumber next = *after;
    const FrameNumber previous = next == held ? next : *std::prev(after);
    const double between = next == previous ? 0 : double(held - previous) / double(next - previous);
    if (previous_ == previous && next_ == next && between_ == between) return false;

    std::erase_if(keys_, [&](const Key& k) { return k.number != previous && k.number != next; });
    keys_.reserve(2);  // so that the first stays where it is when the second comes
    const Key& a = key(previous);
    const Key& b = key(next);
    if (previous == next) {
        light = a.light;
    } else {
        light.radiance = mixed(a.light.radiance, b.light.radiance, float(between));
        light.background = mixed(a.light.background, b.light.background, float(between));
        light.order = std::max(a.light.order, b.light.order);
    }
    previous_ = previous;
    next_ = next;
    between_ = between;
    return true;
}

}  // namespace virga::shot
