#include "matte/FrameFeatures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <opencv2/features2d.hpp>

#include "matte/IntegerHash.h"

namespace virga::matte::alignment {
namespace {

/// A row a feature; the numbers stay where they are.
cv::Mat descriptorsOf(const Features& features)
{
    return cv::Mat(features.descriptors).reshape(1, int(features.places.size()));
}

/// Descriptors that are clearly nearer to each other than to the second (Lowe 2004, section 7.1), either way.
std::vector<Match> matchesOf(const Features& from, const Features& to)
{
    std::vector<Match> result;
    if (from.places.size() < fewestMatches || to.places.size() < fewestMatches) return result;
    const cv::BFMatcher matcher(cv::NORM_L2);
    std::vector<std::vector<cv::DMatch>> forward;
    std::vector<cv::DMatch> back;
    matcher.knnMatch(descriptorsOf(from), descriptorsOf(to), forward, 2);
    matcher.match(descriptorsOf(to), descriptorsOf(from), back);
    for (const auto& pair : forward) {
        if (pair.size() < 2 || !(pair[0].distance < 0.8f * pair[1].distance)) continue;
        if (back[std::size_t(pair[0].trainIdx)].trainIdx != pair[0].queryIdx) continue;
        result.push_back({from.places[std::size_t(pair[0].queryIdx)], to.places[std::size_t(pair[0].trainIdx)]});
    }
    return result;
}

}  // namespace

Features featuresOf(const ImageF& picture, const Grid& grid, int level, int most)
{
    cv::Mat coded(picture.height(), picture.width(), CV_8U);
    for (int y = 0; y < picture.height(); ++y)
        for (int x = 0; x < picture.width(); ++x)
            coded.at<unsigned char>(y, x) =
                static_cast<unsigned char>(std::lround(255 * std::sqrt(std::clamp(picture.at(x, y), 0.0f, 1.0f))));
    std::vector<cv::KeyPoint> points;
    cv::Mat descriptors;
    Features features;
    const auto sift = cv::SIFT::create(most, 3, 0.02);
    sift->detectAndCompute(coded, cv::noArray(), points, descriptors);
    const PlaneTransform normalised = grid.pixels(level).inverse();
    for (const cv::KeyPoint& point : points)
        features.places.push_back(normalised(double(point.pt.x), double(point.pt.y)));
    if (!descriptors.empty()) features.descriptors = descriptors.reshape(1, 1);
    return features;
}

std::optional<PlaneTransform> roughTransform(const Features& from, const Features& to, double tolerance)
{
    const std::vector<Match> matches = matchesOf(from, to);
    if (matches.size() < fewestMatches) return std::nullopt;
    const double limit = tolerance * tolerance;
    PlaneTransform best;
    double least = std::numeric_limits<double>::infinity();
    const auto attempt = [&](const std::optional<PlaneTransform>& m) {
        if (!m || !isPlausible(*m)) return;
        double cost = 0;
        for (const Match& match : matches) {
            cost += std::min(limit, squaredDistance((*m)(match.from.x, match.from.y), match.to));
            if (cost >= least) return;
        }
        least = cost;
        best = *m;
    };
    const auto explained = [&](double within) {
        std::vector<std::size_t> which;
        for (std::size_t i = 0; i < matches.size(); ++i)
            if (squaredDistance(best(matches[i].from.x, matches[i].from.y), matches[i].to) < within) which.push_back(i);
        return which;
    };
    attempt(best);
    std::uint32_t drawn = 0;
    const auto draw = [&] { return std::size_t(hashed(++drawn) % matches.size()); };
    for (int k = 0; k < 300; ++k) {
        const std::array<std::size_t, 2> pair = {draw(), draw()};
        if (std::sqrt(squaredDistance(matches[pair[0]].from, matches[pair[1]].from)) > 0.1)
            attempt(similarityOf(matches, pair));
    }
    for (int k = 0; k < 400; ++k) {
        const std::array<std::size_t, 4> four = {draw(), draw(), draw(), draw()};
        attempt(homographyOf(matches, four));
    }
    // A similarity of two near matches explains the far ones badly: wider at first.
    for (const double factor : {9.0, 4.0, 1.0, 1.0}) {
        const std::vector<std::size_t> which = explained(factor * limit);
        if (which.size() >= fewestMatches) attempt(similarityOf(matches, which));
        if (which.size() >= 2 * fewestMatches) attempt(homographyOf(matches, which));
    }
    if (explained(limit).size() < fewestMatches) return std::nullopt;
    return best;
}

}  // namespace virga::matte::alignment
