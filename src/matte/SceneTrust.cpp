#include "matte/SceneTrust.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/Parallel.h"

namespace virga::matte {
namespace {

constexpr double darkLimit = 3.0, broadLimit = 6.5;  // [sigma], chosen beside the truth of one clip
constexpr double staying = 0.5;                      // of its brightness, in the frames beside
constexpr int darkReach = 1, broadReach = 2, stayReach = 2, margin = 2;
constexpr int tile = 32;            // [px], for the search of evidence that something moves
constexpr double outlier = 4.0;     // [sigma] below the scene: noise alone has 3e-5 of its samples there
constexpr double evidence = 0.005;  // share of a tile's samples, over all frames
constexpr std::size_t mostSamples = 400'000;

/// (I - S), the mean of the channels.
ImageF differenceFrom(const ImageF& frame, const ImageF& scene)
{
    const int channels = frame.channels();
    ImageF difference(frame.width(), frame.height(), 1);
    for (std::size_t i = 0; i < difference.size(); ++i) {
        float sum = 0.0f;
        for (int j = 0; j < channels; ++j)
            sum += frame.data()[i * std::size_t(channels) + std::size_t(j)] -
                   scene.data()[i * std::size_t(channels) + std::size_t(j)];
        difference.data()[i] = sum / float(channels);
    }
    return difference;
}

/// 1.4826 x the median of the values' depth below 0.
double darkSide(std::vector<float>& below)
{
    if (below.empty()) return 0.0;
    const auto middle = below.begin() + std::ptrdiff_t(below.size() / 2);
    std::nth_element(below.begin(), middle, below.end());
    return 1.4826 * *middle;
}

/// Means of windows 2 reach + 1 wide and high; what leaves the picture is left out.
ImageF windowMean(const ImageF& image, int reach)
{
    const int width = image.width(), height = image.height();
    ImageF rows(width, height, 1), mean(width, height, 1);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const int first = std::max(0, x - reach), last = std::min(width - 1, x + reach);
            float sum = 0.0f;
            for (int t = first; t <= last; ++t) sum += image.at(t, y);
            rows.at(x, y) = sum / float(last - first + 1);
        }
    for (int y = 0; y < height; ++y) {
        const int first = std::max(0, y - reach), last = std::min(height - 1, y + reach);
        for (int t = first; t <= last; ++t)
            for (int x = 0; x < width; ++x) mean.at(x, y) += rows.at(x, t);
        for (int x = 0; x < width; ++x) mean.at(x, y) /= float(last - first + 1);
    }
    return mean;
}

/// The largest of windows 2 reach + 1 wide and high.
ImageF windowMost(const ImageF& image, int reach)
{
    const int width = image.width(), height = image.height();
    ImageF rows(width, height, 1), most(width, height, 1);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            rows.at(x, y) = *std::max_element(image.row(y) + std::max(0, x - reach),
                                              image.row(y) + std::min(width - 1, x + reach) + 1);
    for (int y = 0; y < height; ++y) {
        std::copy_n(rows.row(y), width, most.row(y));
        for (int t = std::max(0, y - reach); t <= std::min(height - 1, y + reach); ++t)
            for (int x = 0; x < width; ++x) most.at(x, y) = std::max(most.at(x, y), rows.at(x, t));
    }
    return most;
}

/// 1 for the tiles in and beside which something dark was seen, a pixel a tile.
Image<char> tilesWithEvidence(const std::vector<ImageF>& differences, double sigma)
{
    const int width = differences[0].width(), height = differences[0].height();
    const int columns = (width + tile - 1) / tile, rows = (height + tile - 1) / tile;
    Image<char> seen(columns, rows, 1), tiles(columns, rows, 1);
    const float limit = float(-outlier * sigma);
    parallelFor(0, rows, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int r = int(first); r < int(last); ++r)
            for (int c = 0; c < columns; ++c) {
                const int left = c * tile, right = std::min(width, left + tile);
                const int top = r * tile, bottom = std::min(height, top + tile);
                std::size_t below = 0;
                for (const ImageF& difference : differences)
                    for (int y = top; y < bottom; ++y) {
                        const float* row = difference.row(y);
                        for (int x = left; x < right; ++x) below += row[x] < limit;
                    }
                const double samples = double(right - left) * (bottom - top) * double(differences.size());
                seen.at(c, r) = double(below) > evidence * samples;
            }
    });
    for (int r = 0; r < rows; ++r)
        for (int c = 0; c < columns; ++c)
            for (int v = std::max(0, r - 1); v <= std::min(rows - 1, r + 1); ++v)
                for (int u = std::max(0, c - 1); u <= std::min(columns - 1, c + 1); ++u)
                    tiles.at(c, r) |= seen.at(u, v);
    return tiles;
}

/// before, after: windowMost of the broad means of the frames beside; null where there is none.
ImageF trustOf(const ImageF& difference, const ImageF& broad, const ImageF* before, const ImageF* after,
               const Image<char>& tiles, double sigma)
{
    const int width = difference.width(), height = difference.height();
    ImageF shortfall = difference;
    for (float& value : shortfall.values()) value = std::min(value, 0.0f);
    const ImageF dark = windowMean(shortfall, darkReach);
    const bool isAlone = before == nullptr && after == nullptr;
    ImageF trust(width, height, 1, 1.0f);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            if (!tiles.at(x / tile, y / tile)) continue;
            const double here = broad.at(x, y);
            const auto stays = [&](const ImageF* beside) {
                return beside == nullptr || beside->at(x, y) > staying * here;
            };
            const bool isBright = !isAlone && here > broadLimit * sigma && stays(before) && stays(after);
            if (dark.at(x, y) >= -darkLimit * sigma && !isBright) continue;
            for (int v = std::max(0, y - margin); v <= std::min(height - 1, y + margin); ++v)
                for (int u = std::max(0, x - margin); u <= std::min(width - 1, x + margin); ++u) trust.at(u, v) = 0.0f;
        }
    return trust;
}

}  // namespace

double noiseLevel(std::span<const ImageF> frames, const ImageF& scene)
{
    std::vector<float> below;
    const std::size_t stride = frames.size() * scene.size() / mostSamples + 1;
    std::size_t at = 0;  // goes on from frame to frame, so that no column is left out
    for (const ImageF& frame : frames) {
        for (; at < frame.size(); at += stride)
            if (const float depth = scene.data()[at] - frame.data()[at]; depth > 0.0f) below.push_back(depth);
        at -= frame.size();
    }
    return darkSide(below);
}

std::vector<ImageF> sceneTrust(std::span<const ImageF> frames, const ImageF& scene, double leastNoise)
{
    const auto count = std::ptrdiff_t(frames.size());
    if (frames.empty()) return {};
    std::vector<ImageF> differences(frames.size()), broad(frames.size()), most(frames.size()), trust(frames.size());
    const auto forFrames = [&](const std::function<void(std::size_t)>& body) {
        parallelFor(0, count, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (auto k = std::size_t(first); k < std::size_t(last); ++k) body(k);
        });
    };
    forFrames([&](std::size_t k) { differences[k] = differenceFrom(frames[k], scene); });
    const double sigma = std::max(noiseLevel(differences, ImageF(scene.width(), scene.height(), 1)), leastNoise);
    const Image<char> tiles = tilesWithEvidence(differences, sigma);
    if (std::none_of(tiles.values().begin(), tiles.values().end(), [](char seen) { return seen != 0; })) return {};
    forFrames([&](std::size_t k) {
        broad[k] = windowMean(differences[k], broadReach);
        most[k] = windowMost(broad[k], stayReach);
    });
    forFrames([&](std::size_t k) {
        trust[k] = trustOf(differences[k], broad[k], k > 0 ? &most[k - 1] : nullptr,
                           k + 1 < frames.size() ? &most[k + 1] : nullptr, tiles, sigma);
    });
    return trust;
}

}  // namespace virga::matte
