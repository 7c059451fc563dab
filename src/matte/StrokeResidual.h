// What strokes change, against the scene as all other frames have it.
#pragma once

#include <cmath>
#include <vector>

#include "matte/RainEquation.h"

namespace virga::matte {

/// The scene as the dry samples of all other frames have it. A scene that knows a frame's own rain is a little brighter
/// where that is, which looks like rain that does less over bright ground, and so like a brighter C. Its frames, from 0
/// on, are some of the footage's, evenly spread.
class StrokeResidual {
public:
    /// sigma     noise of the channels' mean
    /// brightest  where the scene is brighter there is a lamp
    StrokeResidual(const Footage& footage, const ImageF& scene, double sigma, double brightest);

    const int width, height, channels;

    /// Of so many frames is the scene here the mean.
    double samples(std::size_t n, std::size_t i) const { return counts_.data()[i] - (isDry(n, i) ? 1.0f : 0.0f); }
    double surface(std::size_t n, std::size_t i, int j) const
    {
        const bool isIn = isDry(n, i);
        const double count = counts_.data()[i] - (isIn ? 1.0f : 0.0f);
        if (count < 1.0) return scene_.data()[at(i, j)];
        return (double(sums_.data()[at(i, j)]) - (isIn ? value(n, i, j) : 0.0)) / count;
    }
    double off(std::size_t n, std::size_t i, int j) const { return value(n, i, j) - surface(n, i, j); }
    /// Of the channels; against the scene as it was solved.
    const ImageF& mean(std::size_t n) const { return means_[n]; }
    /// Where it is trusted and beyond `limits`.
    Image<char> wet(std::size_t n, const ImageF& limits) const;
    /// Not so a lamp: between it and what is beside it the scene is so steep that nothing else would have a say.
    bool isTrusted(std::size_t n, std::size_t i) const
    {
        return footage_.trusted(which_[n], i) > least && scene_.data()[at(i, 0)] <= brightest_;
    }
    std::size_t frames() const { return which_.size(); }

private:
    static constexpr float least = 0.5f;  // of trust

    std::size_t at(std::size_t i, int j) const { return i * std::size_t(channels) + std::size_t(j); }
    double value(std::size_t n, std::size_t i, int j) const
    {
        return double(footage_.frames[which_[n]].data()[at(i, j)]);
    }
    bool isDry(std::size_t n, std::size_t i) const
    {
        return isTrusted(n, i) && std::abs(means_[n].data()[i]) <= limit_;
    }

    const Footage& footage_;
    const ImageF& scene_;
    ImageF sums_, counts_;
    std::vector<std::size_t> which_;
    std::vector<ImageF> means_;
    float limit_, brightest_;
};

}  // namespace virga::matte
