#include "GargNayar.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace virga::bench {
namespace {

/// Mean of the channels, in levels of 255.
cv::Mat greyLevels(const ImageF& frame)
{
    cv::Mat grey(frame.height(), frame.width(), CV_32F);
    for (int y = 0; y < frame.height(); ++y)
        for (int x = 0; x < frame.width(); ++x) {
            float sum = 0;
            for (int c = 0; c < frame.channels(); ++c) sum += frame.at(x, y, c);
            grey.at<float>(y, x) = 255 * sum / float(frame.channels());
        }
    return grey;
}

struct Neighbours {
    std::size_t before, after;
};

Neighbours neighbours(std::size_t n, std::size_t count)
{
    if (n == 0) return {1, 2};
    if (n + 1 == count) return {n - 2, n - 1};
    return {n - 1, n + 1};
}

/// Sums for the line dI = intercept + slope I_b through the pixels of a streak.
struct LineFit {
    double count = 0, b = 0, d = 0, bb = 0, bd = 0, dd = 0;

    void add(double background, double change)
    {
        ++count;
        b += background;
        d += change;
        bb += background * background;
        bd += background * change;
        dd += change * change;
    }

    /// Whether a slope of -maxBeta..0 is within `errors` standard errors. Three pixels or a flat background say nothing
    /// against it.
    bool allows(double maxBeta, double errors) const
    {
        const double spread = bb - b * b / count;
        if (count < 4 || spread < 1e-3 * count) return true;
        const double together = bd - b * d / count, slope = together / spread;
        const double residual = std::max(0.0, dd - d * d / count - slope * together);
        const double rounding = 1e-4;  // of floats, where a streak is exactly as bright everywhere
        const double error = rounding + errors * std::sqrt(residual / (count - 2) / spread);
        return -slope >= -error && -slope <= maxBeta + error;
    }
};

/// Candidates by the change against both neighbours, streaks of them by the photometric constraint; 1 or 0, CV_32F.
cv::Mat photometricStreaks(const cv::Mat& frame, const cv::Mat& before, const cv::Mat& after,
                           const GargNayarOptions& options)
{
    cv::Mat candidates(frame.size(), CV_8U, cv::Scalar(0));
    for (int y = 0; y < frame.rows; ++y)
        for (int x = 0; x < frame.cols; ++x) {
            const float rise = frame.at<float>(y, x) - before.at<float>(y, x),
                        fall = frame.at<float>(y, x) - after.at<float>(y, x);
            // A hair less: differences of 8-bit codes are whole levels but for the rounding of floats.
            candidates.at<unsigned char>(y, x) =
                std::min(rise, fall) >= options.c - 1e-3 && std::abs(rise - fall) <= options.equality + 1e-3;
        }
    cv::Mat labels;
    const int streaks = cv::connectedComponents(candidates, labels, 8, CV_32S);
    std::vector<LineFit> fits(static_cast<std::size_t>(streaks));
    for (int y = 0; y < frame.rows; ++y)
        for (int x = 0; x < frame.cols; ++x) {
            const double background = 0.5 * (double(before.at<float>(y, x)) + after.at<float>(y, x));
            fits[std::size_t(labels.at<int>(y, x))].add(background, frame.at<float>(y, x) - background);
        }
    cv::Mat rain(frame.size(), CV_32F, cv::Scalar(0));
    for (int y = 0; y < frame.rows; ++y)
        for (int x = 0; x < frame.cols; ++x) {
            const int streak = labels.at<int>(y, x);
            if (streak > 0 &&
                (!options.photometric || fits[std::size_t(streak)].allows(options.maxSlope, options.slopeErrors)))
                rain.at<float>(y, x) = 1;
        }
    return rain;
}

/// Kernel of the mean over a line through the pixel, itself left out. `angle` [rad] from vertical, lower end to the
/// right.
cv::Mat lineKernel(int length, double angle)
{
    cv::Mat kernel(length, length, CV_32F, cv::Scalar(0));
    const int half = length / 2;
    for (int t = -half; t <= half; ++t)
        if (t != 0)
            kernel.at<float>(half + int(std::lround(t * std::cos(angle))),
                             half + int(std::lround(t * std::sin(angle)))) = 1.0f / float(2 * half);
    return kernel;
}

/// For every frame of the binary field, how much more it correlates with itself along the best direction than on
/// average. Correlations of a frame are means over the window and over the frames around it.
class DirectionalCorrelation {
public:
    DirectionalCorrelation(const std::vector<cv::Mat>& field, const GargNayarOptions& options)
        : frames_(std::min(field.size(), std::size_t(options.frames)))
    {
        const cv::Size window(options.window, options.window);
        for (const cv::Mat& frame : field) {
            cv::Mat mean;
            cv::boxFilter(frame, mean, CV_32F, window, {-1, -1}, true, cv::BORDER_CONSTANT);
            density_.push_back(mean);
        }
        for (int step = 0; step < directions; ++step) {
            const cv::Mat line = lineKernel(options.lineLength, step * std::numbers::pi / directions);
            for (std::size_t n = 0; n < field.size(); ++n) {
                cv::Mat along, product;
                cv::filter2D(field[n], along, CV_32F, line, {-1, -1}, 0, cv::BORDER_CONSTANT);
                cv::boxFilter(field[n].mul(along), product, CV_32F, window, {-1, -1}, true, cv::BORDER_CONSTANT);
                products_[step].push_back(product);
            }
        }
    }

    cv::Mat around(std::size_t frame) const
    {
        const std::size_t half = frames_ / 2, end = density_.size() - frames_;
        const std::size_t first = std::min(frame > half ? frame - half : 0, end);
        const cv::Mat density = meanFrom(density_, first);
        const cv::Mat variance = cv::max(density - density.mul(density), 1e-6);
        cv::Mat best(density.size(), CV_32F, cv::Scalar(-1)), mean(density.size(), CV_32F, cv::Scalar(0));
        for (const auto& products : products_) {
            const cv::Mat correlation = (meanFrom(products, first) - density.mul(density)) / variance;
            best = cv::max(best, correlation);
            mean += correlation / directions;
        }
        return best - mean;
    }

private:
    static constexpr int directions = 12;  // of half a turn, 15 degrees apart

    cv::Mat meanFrom(const std::vector<cv::Mat>& maps, std::size_t first) const
    {
        cv::Mat sum = maps[first].clone();
        for (std::size_t i = 1; i < frames_; ++i) sum += maps[first + i];
        return sum / double(frames_);
    }

    std::size_t frames_;
    std::vector<cv::Mat> density_, products_[directions];
};

}  // namespace

std::vector<ImageF> gargNayar(const std::vector<ImageF>& frames, const GargNayarOptions& options)
{
    assert(frames.size() >= 3);
    std::vector<cv::Mat> levels, field;
    for (const ImageF& frame : frames) levels.push_back(greyLevels(frame));
    for (std::size_t n = 0; n < frames.size(); ++n) {
        const auto [before, after] = neighbours(n, frames.size());
        field.push_back(photometricStreaks(levels[n], levels[before], levels[after], options));
    }
    if (options.directional > 0) {
        const DirectionalCorrelation correlation(field, options);
        for (std::size_t n = 0; n < frames.size(); ++n) {
            field[n].setTo(0, correlation.around(n) < options.directional);
        }
    }

    std::vector<ImageF> derained = frames;
    for (std::size_t n = 0; n < frames.size(); ++n) {
        const auto [before, after] = neighbours(n, frames.size());
        ImageF& frame = derained[n];
        for (int y = 0; y < frame.height(); ++y)
            for (int x = 0; x < frame.width(); ++x) {
                if (field[n].at<float>(y, x) == 0) continue;
                for (int c = 0; c < frame.channels(); ++c)
                    frame.at(x, y, c) = 0.5f * (frames[before].at(x, y, c) + frames[after].at(x, y, c));
            }
    }
    return derained;
}

}  // namespace virga::bench
