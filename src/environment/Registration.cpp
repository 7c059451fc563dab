#include "environment/Registration.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <numbers>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <queue>
#include <tuple>

#include "core/Error.h"
#include "core/Parallel.h"

namespace virga::environment {

/// Descriptors a row each; places in pixels of the frame from its middle, x right, y up.
struct Features::Data {
    std::vector<glm::dvec2> place;
    cv::Mat descriptors;
};

namespace {

constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180.0;

constexpr int matchingWidth = 800;  // of the larger side, in which features are looked for [px]
constexpr int mostFeatures = 1000;
constexpr double tolerance = 0.004;        // a match that is explained is that near, over the frame's width
constexpr std::size_t fewestMatches = 16;  // that a pair of frames needs
constexpr double trustedDeviation = 0.08;  // of the focal length: beyond it the usual one is as good

/// 8 bits, display-like and scaled to the picture's own range, so that dark footage has features too.
cv::Mat displayed(ConstImageViewF plate)
{
    std::vector<float> luminance(std::size_t(plate.width()) * std::size_t(plate.height()));
    std::vector<float> sample;
    std::size_t at = 0;
    for (int y = 0; y < plate.height(); ++y) {
        for (int x = 0; x < plate.width(); ++x, ++at) {
            const float* p = plate.pixel(x, y);
            const float value = plate.channels() >= 3 ? 0.2126f * p[0] + 0.7152f * p[1] + 0.0722f * p[2] : p[0];
            luminance[at] = std::isfinite(value) ? std::max(value, 0.0f) : 0.0f;
            if (at % 17 == 0) sample.push_back(luminance[at]);
        }
    }
    const auto high = sample.begin() + std::ptrdiff_t(double(sample.size() - 1) * 0.98);
    std::nth_element(sample.begin(), high, sample.end());
    const float white = *high;
    cv::Mat picture(plate.height(), plate.width(), CV_8U, cv::Scalar(0));
    if (white <= 1e-5f) return picture;
    at = 0;
    for (int y = 0; y < plate.height(); ++y) {
        for (int x = 0; x < plate.width(); ++x, ++at)
            picture.at<unsigned char>(y, x) =
                static_cast<unsigned char>(std::lround(255 * std::sqrt(std::min(1.0f, luminance[at] / white))));
    }
    return picture;
}

/// A place seen in two frames, pixels from the middle.
struct Match {
    glm::dvec2 a, b;
};

/// Two frames that show the same things.
struct Pair {
    std::size_t a, b;
    std::vector<Match> matches;
    glm::dmat3 bFromA{1.0};
    std::vector<std::size_t> explained;  // matches that bFromA explains
    double cost = 0;                     // truncated squares, over the matches' number
    bool holds() const
    {
        return explained.size() >= fewestMatches && double(explained.size()) >= 0.25 * double(matches.size());
    }
};

/// Nearest descriptors that are each other's and clearly nearer than the second (Lowe 2004).
std::vector<Match> matched(const Features::Data& a, const Features::Data& b)
{
    std::vector<Match> result;
    if (a.place.size() < fewestMatches || b.place.size() < fewestMatches) return result;
    const cv::BFMatcher matcher(cv::NORM_L2);
    std::vector<std::vector<cv::DMatch>> forward;
    matcher.knnMatch(a.descriptors, b.descriptors, forward, 2);
    std::vector<int> nearestOfB(b.place.size(), -1);
    std::vector<float> distanceOfB(b.place.size(), 0);
    for (const auto& pair : forward) {
        if (pair.size() < 2 || pair[0].distance > 0.8f * pair[1].distance) continue;
        const std::size_t to = std::size_t(pair[0].trainIdx);
        if (nearestOfB[to] >= 0 && distanceOfB[to] <= pair[0].distance) continue;
        nearestOfB[to] = pair[0].queryIdx;
        distanceOfB[to] = pair[0].distance;
    }
    for (std::size_t i = 0; i < nearestOfB.size(); ++i) {
        if (nearestOfB[i] >= 0) result.push_back({a.place[std::size_t(nearestOfB[i])], b.place[i]});
    }
    return result;
}

glm::dvec3 ray(const glm::dvec2& place, double focal) { return glm::normalize(glm::dvec3(place, -focal)); }

glm::dmat3 fromEigen(const Eigen::Matrix3d& m)
{
    glm::dmat3 result;
    for (int c = 0; c < 3; ++c) {
        for (int r = 0; r < 3; ++r) result[c][r] = m(r, c);
    }
    return result;
}

/// The rotation that takes the a's to the b's best (Kabsch 1976).
glm::dmat3 bestRotation(std::span<const glm::dvec3> a, std::span<const glm::dvec3> b,
                        std::span<const std::size_t> which)
{
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    for (const std::size_t i : which) {
        covariance += Eigen::Vector3d(b[i].x, b[i].y, b[i].z) * Eigen::RowVector3d(a[i].x, a[i].y, a[i].z);
    }
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d flip = Eigen::Matrix3d::Identity();
    flip(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
    return fromEigen(svd.matrixU() * flip * svd.matrixV().transpose());
}

/// Axes with the first along a and the second in the plane of a and b.
glm::dmat3 triad(const glm::dvec3& a, const glm::dvec3& b)
{
    const glm::dvec3 z = glm::normalize(glm::cross(a, b));
    return {a, glm::cross(z, a), z};
}

/// Finds the pair's rotation for a focal length: samples of two matches, the least truncated squares (Torr and
/// Zisserman 2000, MSAC), then least squares over what it explains.
void solve(Pair& pair, double focal, double limit_px)
{
    const std::size_t count = pair.matches.size();
    const double limit = limit_px / focal;
    pair.explained.clear();
    pair.cost = limit_px * limit_px;
    pair.bFromA = glm::dmat3(1.0);
    if (count < fewestMatches) return;
    std::vector<glm::dvec3> a(count), b(count);
    for (std::size_t i = 0; i < count; ++i) {
        a[i] = ray(pair.matches[i].a, focal);
        b[i] = ray(pair.matches[i].b, focal);
    }
    // Errors as distances of unit vectors, in pixels near the middle of the frame.
    const auto costOf = [&](const glm::dmat3& rotation) {
        double sum = 0.0;
        for (std::size_t i = 0; i < count; ++i) {
            const glm::dvec3 apart = rotation * a[i] - b[i];
            sum += std::min(glm::dot(apart, apart), limit * limit);
        }
        return sum;
    };
    double best = double(count) * limit * limit;
    glm::dmat3 rotation(1.0);
    std::uint64_t state = 0x9E3779B97F4A7C15u * (pair.a * 4099 + pair.b + 1);
    const auto next = [&state, count] {
        state = state * 6364136223846793005u + 1442695040888963407u;
        return std::size_t((state >> 33) % count);
    };
    const auto attempt = [&](const glm::dmat3& candidate) {
        const double cost = costOf(candidate);
        if (cost < best) {
            best = cost;
            rotation = candidate;
        }
    };
    attempt(glm::dmat3(1.0));
    for (int i = 0; i < 200; ++i) {
        const std::size_t k = next(), l = next();
        const double apartA = glm::length(a[k] - a[l]), apartB = glm::length(b[k] - b[l]);
        if (apartA < 0.05 || std::abs(apartA - apartB) > 2.0 * limit) continue;
        attempt(triad(b[k], b[l]) * glm::transpose(triad(a[k], a[l])));
    }
    const auto explainedBy = [&](const glm::dmat3& candidate) {
        std::vector<std::size_t> which;
        for (std::size_t i = 0; i < count; ++i) {
            if (glm::length(candidate * a[i] - b[i]) < limit) which.push_back(i);
        }
        return which;
    };
    for (int i = 0; i < 3; ++i) {
        const std::vector<std::size_t> which = explainedBy(rotation);
        if (which.size() < 3) break;
        attempt(bestRotation(a, b, which));
    }
    pair.bFromA = rotation;
    pair.explained = explainedBy(rotation);
    pair.cost = best / (limit * limit) * limit_px * limit_px / double(count);
}

/// Turns by a small vector.
glm::dmat3 turn(const glm::dvec3& by)
{
    const double angle = glm::length(by);
    if (angle < 1e-300) return glm::dmat3(1.0);
    const Eigen::Vector3d axis(by.x / angle, by.y / angle, by.z / angle);
    return fromEigen(Eigen::AngleAxisd(angle, axis).toRotationMatrix());
}

/// All that is known while frames are put together.
struct Puzzle {
    std::span<const Features> frames;
    double focal;  // [px]
    double limit_px;
    std::map<std::pair<std::size_t, std::size_t>, Pair> pairs;
    std::vector<std::optional<glm::dmat3>> rotation;  // worldFromCamera

    explicit Puzzle(std::span<const Features> f)
        : frames(f), focal(f[0].width()), limit_px(std::max(1.5, tolerance * f[0].width())), rotation(f.size())
    {
    }

    /// Matches the pairs that were not matched before, on all cores.
    void match(std::vector<std::pair<std::size_t, std::size_t>> wanted)
    {
        std::erase_if(wanted, [&](const auto& w) { return pairs.contains(w); });
        std::vector<Pair> made(wanted.size());
        parallelFor(0, std::ptrdiff_t(wanted.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (std::size_t i = std::size_t(first); i < std::size_t(last); ++i) {
                made[i].a = wanted[i].first;
                made[i].b = wanted[i].second;
                made[i].matches = matched(frames[made[i].a].data(), frames[made[i].b].data());
                solve(made[i], focal, limit_px);
            }
        });
        for (std::size_t i = 0; i < wanted.size(); ++i) pairs.emplace(wanted[i], std::move(made[i]));
    }

    /// Solves every pair for a focal length; the mean of their costs.
    double solveAll(double focalLength)
    {
        std::vector<Pair*> all;
        for (auto& [key, pair] : pairs) all.push_back(&pair);
        parallelFor(0, std::ptrdiff_t(all.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (std::ptrdiff_t i = first; i < last; ++i) solve(*all[std::size_t(i)], focalLength, limit_px);
        });
        focal = focalLength;
        double sum = 0.0, weights = 0.0;
        for (const Pair* pair : all) {
            if (pair->matches.size() < fewestMatches) continue;
            // More than chance: matches that nothing explains say nothing of the focal length.
            sum += pair->cost * double(pair->matches.size());
            weights += double(pair->matches.size());
        }
        return weights > 0.0 ? sum / weights : 0.0;
    }

    /// Rotations of the largest group of frames that hang together, along the pairs with the most matches.
    void chain()
    {
        std::vector<std::optional<glm::dmat3>> best(frames.size());
        std::size_t most = 0;
        std::vector<char> seen(frames.size(), 0);
        for (std::size_t root = 0; root < frames.size(); ++root) {
            if (seen[root]) continue;
            std::vector<std::optional<glm::dmat3>> placed(frames.size());
            placed[root] = glm::dmat3(1.0);
            std::size_t count = 1;
            for (;;) {
                const Pair* strongest = nullptr;
                for (const auto& [key, pair] : pairs) {
                    if (!pair.holds() || placed[pair.a].has_value() == placed[pair.b].has_value()) continue;
                    if (strongest == nullptr || pair.explained.size() > strongest->explained.size()) strongest = &pair;
                }
                if (strongest == nullptr) break;
                // bFromA = transpose(worldFromB) worldFromA
                if (placed[strongest->a])
                    placed[strongest->b] = *placed[strongest->a] * glm::transpose(strongest->bFromA);
                else
                    placed[strongest->a] = *placed[strongest->b] * strongest->bFromA;
                ++count;
            }
            for (std::size_t i = 0; i < frames.size(); ++i) seen[i] = seen[i] || placed[i].has_value();
            if (count > most) {
                most = count;
                best = std::move(placed);
            }
        }
        rotation = std::move(best);
    }

    std::size_t joined() const
    {
        return std::size_t(
            std::count_if(rotation.begin(), rotation.end(), [](const auto& r) { return r.has_value(); }));
    }

    struct Adjusted {
        double deviation = 1;  // of the focal length, over it
        double residual_px = 0;
        int matches = 0;
    };

    /// Rotations, and the focal length if it is free, by Levenberg and Marquardt's method over all explained matches,
    /// weighted after Cauchy.
    Adjusted adjust(bool focalIsFree, double usualFocal)
    {
        std::vector<int> number(frames.size(), -1);
        int unknowns = 0;
        bool isFirst = true;
        for (std::size_t i = 0; i < frames.size(); ++i) {
            if (!rotation[i]) continue;
            if (!isFirst) number[i] = 3 * unknowns++;
            isFirst = false;
        }
        const int size = 3 * unknowns + (focalIsFree ? 1 : 0);
        std::vector<const Pair*> used;
        for (const auto& [key, pair] : pairs) {
            if (pair.holds() && rotation[pair.a] && rotation[pair.b]) used.push_back(&pair);
        }
        const double scale = 0.3 * limit_px;
        constexpr double focalPrior = 1.0;  // standard deviation of the logarithm
        struct System {
            Eigen::MatrixXd normal;
            Eigen::VectorXd gradient;
            double cost = 0;
            double squares = 0;
            int matches = 0;
        };
        const auto build = [&](const std::vector<std::optional<glm::dmat3>>& turned, double f, bool derivatives) {
            System s;
            if (derivatives) {
                s.normal = Eigen::MatrixXd::Zero(size, size);
                s.gradient = Eigen::VectorXd::Zero(size);
            }
            for (const Pair* pair : used) {
                const glm::dmat3 bFromA = glm::transpose(*turned[pair->b]) * *turned[pair->a];
                // At most 80 matches a pair: more add time, and pairs near in time would drown those far apart.
                const std::size_t step = (pair->explained.size() + 79) / 80;
                for (std::size_t k = 0; k < pair->explained.size(); k += step) {
                    const Match& match = pair->matches[pair->explained[k]];
                    const glm::dvec3 a(match.a, -f);
                    const glm::dvec3 p = bFromA * a;
                    if (p.z > -1e-3 * f) continue;
                    const glm::dvec2 seen(-f * p.x / p.z, -f * p.y / p.z);
                    const glm::dvec2 error = seen - match.b;
                    const double square = glm::dot(error, error) / (scale * scale);
                    s.cost += std::log1p(square);
                    ++s.matches;
                    s.squares += glm::dot(error, error);
                    if (!derivatives) continue;
                    const double weight = 1.0 / (1.0 + square) / (scale * scale);
                    for (int r = 0; r < 2; ++r) {
                        glm::dvec3 byP(0.0);
                        byP[r] = -f / p.z;
                        byP.z = f * p[r] / (p.z * p.z);
                        // p = exp(-wb) bFromA exp(wa) a
                        const glm::dvec3 byA = glm::cross(a, glm::transpose(bFromA) * byP);
                        const glm::dvec3 byB = glm::cross(byP, p);
                        const double byF = f * (-p[r] / p.z - glm::dot(byP, bFromA[2]));
                        int index[7];
                        double value[7];
                        int entries = 0;
                        for (int c = 0; c < 3; ++c) {
                            if (number[pair->a] >= 0) {
                                index[entries] = number[pair->a] + c;
                                value[entries++] = byA[c];
                            }
                            if (number[pair->b] >= 0) {
                                index[entries] = number[pair->b] + c;
                                value[entries++] = byB[c];
                            }
                        }
                        if (focalIsFree) {
                            index[entries] = size - 1;
                            value[entries++] = byF;
                        }
                        for (int i = 0; i < entries; ++i) {
                            s.gradient[index[i]] += weight * value[i] * error[r];
                            for (int j = 0; j < entries; ++j)
                                s.normal(index[i], index[j]) += weight * value[i] * value[j];
                        }
                    }
                }
            }
            if (focalIsFree) {
                const double off = std::log(f / usualFocal);
                s.cost += off * off / (focalPrior * focalPrior);
                if (derivatives) {
                    s.normal(size - 1, size - 1) += 1.0 / (focalPrior * focalPrior);
                    s.gradient[size - 1] += off / (focalPrior * focalPrior);
                }
            }
            return s;
        };

        Adjusted result;
        if (used.empty() || size == 0) return result;
        double damping = 1e-3;
        System now = build(rotation, focal, true);
        for (int iteration = 0; iteration < 60 && damping < 1e8; ++iteration) {
            Eigen::MatrixXd damped = now.normal;
            damped.diagonal() *= 1.0 + damping;
            damped.diagonal().array() += 1e-9;
            const Eigen::VectorXd step = -damped.ldlt().solve(now.gradient);
            auto turned = rotation;
            for (std::size_t i = 0; i < frames.size(); ++i) {
                if (number[i] < 0) continue;
                *turned[i] = *turned[i] * turn({step[number[i]], step[number[i] + 1], step[number[i] + 2]});
            }
            const double f = focalIsFree ? focal * std::exp(std::clamp(step[size - 1], -0.3, 0.3)) : focal;
            const System then = build(turned, f, false);
            if (then.cost < now.cost) {
                const bool isDone = now.cost - then.cost < 1e-7 * now.cost;
                rotation = std::move(turned);
                focal = f;
                damping = std::max(1e-9, 0.2 * damping);
                now = build(rotation, focal, true);
                if (isDone) break;
            } else {
                damping *= 8.0;
            }
        }
        result.matches = now.matches;
        result.residual_px = now.matches > 0 ? std::sqrt(now.squares / now.matches) : 0.0;
        if (focalIsFree) {
            Eigen::VectorXd unit = Eigen::VectorXd::Zero(size);
            unit[size - 1] = 1.0;
            Eigen::MatrixXd normal = now.normal;
            normal.diagonal().array() += 1e-9;
            result.deviation = std::sqrt(std::max(0.0, normal.ldlt().solve(unit)[size - 1]));
        }
        return result;
    }
};

/// Up is what all the cameras' sides are level to (Brown and Lowe 2007, 5); where they hardly turn it is the mean of
/// their own. Then everything is turned about it until the first looks along azimuth 0.
void level(std::vector<std::optional<glm::dmat3>>& rotation)
{
    Eigen::Matrix3d sides = Eigen::Matrix3d::Zero();
    glm::dvec3 meanUp(0.0);
    double count = 0.0;
    for (const auto& r : rotation) {
        if (!r) continue;
        const Eigen::Vector3d x((*r)[0].x, (*r)[0].y, (*r)[0].z);
        sides += x * x.transpose();
        meanUp += (*r)[1];
        count += 1.0;
    }
    if (count == 0.0) return;
    const Eigen::Vector3d up(meanUp.x / count, meanUp.y / count, meanUp.z / count);
    constexpr double habit = 0.02;  // of holding cameras level: decides where a turn of a few degrees tells nothing
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(sides / count - habit * up * up.transpose());
    Eigen::Vector3d axis = solver.eigenvectors().col(0);
    if (axis.dot(up) < 0.0) axis = -axis;
    const glm::dvec3 y(axis.x(), axis.y(), axis.z());

    const auto first = std::find_if(rotation.begin(), rotation.end(), [](const auto& r) { return r.has_value(); });
    glm::dvec3 z = (**first)[2] - glm::dot((**first)[2], y) * y;
    if (glm::length(z) < 1e-6) z = (**first)[1] - glm::dot((**first)[1], y) * y;
    z = glm::normalize(z);
    const glm::dmat3 worldFromOld = glm::transpose(glm::dmat3(glm::cross(y, z), y, z));
    for (auto& r : rotation) {
        if (r) r = worldFromOld * *r;
    }
}

double median(std::vector<double>& values)
{
    if (values.empty()) return 0.0;
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

}  // namespace

Features::Features(ConstImageViewF plate) : width_(plate.width()), height_(plate.height())
{
    const auto data = std::make_shared<Data>();
    data_ = data;
    if (plate.empty()) return;
    cv::Mat picture = displayed(plate);
    const double scale = std::min(1.0, double(matchingWidth) / std::max(width_, height_));
    if (scale < 1.0) cv::resize(picture, picture, cv::Size(), scale, scale, cv::INTER_AREA);
    if (picture.cols < 16 || picture.rows < 16) return;
    std::vector<cv::KeyPoint> points;
    const cv::Ptr<cv::SIFT> sift = cv::SIFT::create(mostFeatures, 3, 0.02);
    sift->detect(picture, points);
    // In an order that does not depend on threads.
    std::sort(points.begin(), points.end(), [](const cv::KeyPoint& a, const cv::KeyPoint& b) {
        return std::tie(a.pt.x, a.pt.y, a.size, a.angle, a.octave) <
               std::tie(b.pt.x, b.pt.y, b.size, b.angle, b.octave);
    });
    if (points.empty()) return;
    sift->compute(picture, points, data->descriptors);
    const double sx = double(width_) / picture.cols, sy = double(height_) / picture.rows;
    for (const cv::KeyPoint& point : points) {
        data->place.emplace_back((point.pt.x + 0.5) * sx - 0.5 * width_, 0.5 * height_ - (point.pt.y + 0.5) * sy);
    }
}

int Features::count() const { return int(data_->place.size()); }

MotionReport judgeMotion(std::span<const Features> frames, double horizontalFov)
{
    MotionReport report;
    report.frames = int(frames.size());
    if (frames.size() < 2) return report;
    Puzzle puzzle(frames);
    puzzle.focal = 0.5 * frames[0].width() / std::tan(0.5 * horizontalFov);
    std::vector<std::pair<std::size_t, std::size_t>> wanted;
    for (std::size_t i = 1; i < frames.size(); ++i) {
        wanted.emplace_back(0, i);
        wanted.emplace_back(i - 1, i);
    }
    puzzle.match(wanted);

    std::vector<double> shifts, growths;
    double stillPairs = 0.0, turned = 0.0, total = 0.0;
    for (const auto& [key, pair] : puzzle.pairs) {
        if (pair.matches.size() < fewestMatches) continue;
        if (pair.b == pair.a + 1) {
            ++report.pairs;
            turned += double(pair.explained.size());
            total += double(pair.matches.size());
            std::vector<double> growth;
            for (std::size_t k = 0; k + 7 < pair.matches.size(); ++k) {
                const double before = glm::length(pair.matches[k].a - pair.matches[k + 7].a);
                const double after = glm::length(pair.matches[k].b - pair.matches[k + 7].b);
                if (before > 0.1 * frames[0].width()) growth.push_back(after / before - 1.0);
            }
            if (!growth.empty()) growths.push_back(median(growth));
        }
        if (pair.a != 0) continue;
        std::vector<double> distance;
        for (const Match& match : pair.matches) distance.push_back(glm::length(match.a - match.b) / frames[0].width());
        const double shift = median(distance);
        shifts.push_back(shift);
        const std::size_t near =
            std::size_t(std::count_if(distance.begin(), distance.end(), [](double d) { return d < 0.015; }));
        if (shift < 0.01 && double(near) > 0.6 * double(distance.size())) stillPairs += 1.0;
    }
    if (report.pairs == 0) return report;
    report.shift = median(shifts);
    report.expansion = median(growths);
    report.turnedShare = total > 0.0 ? turned / total : 0.0;
    if (stillPairs > 0.7 * double(frames.size() - 1))
        report.motion = CameraMotion::Still;
    else
        report.motion = report.turnedShare > 0.6 ? CameraMotion::Turning : CameraMotion::Travelling;
    return report;
}

Registration registerTurns(std::span<const Features> frames, const RegistrationOptions& options)
{
    if (frames.empty()) throw Error(ErrorCode::InvalidArgument, "no frame to register: must be 1 or more");
    for (const Features& frame : frames) {
        if (frame.width() != frames[0].width() || frame.height() != frames[0].height())
            throw Error(ErrorCode::InvalidArgument, "frames of {} x {} and {} x {} pixels: must be of one size",
                        frames[0].width(), frames[0].height(), frame.width(), frame.height());
    }
    const double fov = options.horizontalFov.value_or(options.usualFov);
    if (!(fov > 0.0 && fov <= 170.0 * degree))
        throw Error(ErrorCode::InvalidArgument,
                    "horizontal field of view {:.4g} degrees: must be over 0 and at most 170", fov / degree);
    const double width = frames[0].width();
    const auto focalOf = [width](double angle) { return 0.5 * width / std::tan(0.5 * angle); };
    const std::size_t count = frames.size();

    Registration result;
    result.horizontalFov = fov;
    result.worldFromCamera.resize(count);
    Puzzle puzzle(frames);
    puzzle.focal = focalOf(fov);

    // Neighbours, then frames ever farther apart in time as long as the nearer ones had something in common.
    for (std::size_t apart = 1; apart < count; apart *= 2) {
        std::vector<std::pair<std::size_t, std::size_t>> wanted;
        for (std::size_t i = 0; i + apart < count; ++i) {
            if (apart > 1) {
                const auto half = puzzle.pairs.find({i, i + apart / 2});
                if (half == puzzle.pairs.end() || half->second.matches.size() < 2 * fewestMatches) continue;
            }
            wanted.emplace_back(i, i + apart);
        }
        puzzle.match(wanted);
    }
    if (!options.horizontalFov) {
        double least = 0.0, best = 0.0;
        for (const double angle : {16.0, 22.0, 28.0, 34.0, 40.0, 46.0, 53.0, 60.0, 68.0, 77.0, 87.0, 100.0, 115.0}) {
            const double cost = puzzle.solveAll(focalOf(angle * degree));
            if (best == 0.0 || cost < least) {
                least = cost;
                best = focalOf(angle * degree);
            }
        }
        puzzle.solveAll(best);
    }
    puzzle.chain();
    const bool isFree = !options.horizontalFov.has_value();
    Puzzle::Adjusted adjusted = puzzle.adjust(isFree, focalOf(options.usualFov));

    // Frames that look the same way but are apart in time: a turn that comes back, or goes all the way around.
    std::vector<std::pair<std::size_t, std::size_t>> wanted;
    const double reach = 0.6 * 2.0 * std::atan(0.5 * width / puzzle.focal);
    for (std::size_t i = 0; i < count; ++i) {
        std::vector<std::pair<double, std::size_t>> near;
        for (std::size_t k = i + 2; k < count; ++k) {
            if (!puzzle.rotation[i] || !puzzle.rotation[k]) continue;
            const double angle =
                std::acos(std::clamp(glm::dot((*puzzle.rotation[i])[2], (*puzzle.rotation[k])[2]), -1.0, 1.0));
            // Chains drift: what seems to be somewhat too far may be near.
            if (angle < 1.5 * reach && !puzzle.pairs.contains({i, k})) near.emplace_back(angle, k);
        }
        std::sort(near.begin(), near.end());
        for (std::size_t k = 0; k < std::min<std::size_t>(near.size(), 3); ++k) wanted.emplace_back(i, near[k].second);
    }
    const bool isLoop = !wanted.empty();
    if (isLoop) {
        puzzle.match(wanted);
        puzzle.solveAll(puzzle.focal);
        puzzle.chain();
        adjusted = puzzle.adjust(isFree, focalOf(options.usualFov));
    }
    if (isFree) {
        // Once more with the pairs judged by the focal length that was found.
        puzzle.solveAll(puzzle.focal);
        puzzle.chain();
        adjusted = puzzle.adjust(true, focalOf(options.usualFov));
        if (puzzle.joined() < 2 || adjusted.deviation > trustedDeviation) {
            puzzle.solveAll(focalOf(options.usualFov));
            puzzle.chain();
            const double deviation = adjusted.deviation;
            adjusted = puzzle.adjust(false, puzzle.focal);
            adjusted.deviation = deviation;
        } else {
            result.fovIsEstimated = true;
        }
    }
    result.fovDeviation = isFree ? adjusted.deviation : 0.0;
    result.horizontalFov = 2.0 * std::atan(0.5 * width / puzzle.focal);
    result.residual_px = adjusted.residual_px;
    result.matches = adjusted.matches;

    double turned = 0.0;
    for (const auto& [key, pair] : puzzle.pairs) {
        if (!pair.holds() || !puzzle.rotation[pair.a]) continue;
        if (pair.b == pair.a + 1) turned += std::acos(std::clamp(pair.bFromA[2].z, -1.0, 1.0));
    }
    for (const auto& [key, pair] : puzzle.pairs) {
        const double from = double(pair.b - pair.a) / double(count);
        if (pair.holds() && puzzle.rotation[pair.a] && from > 0.5 && turned > 1.6 * pi) result.closes = true;
    }
    for (std::size_t i = 0; i + 1 < count; ++i) {
        if (!puzzle.pairs.at({i, i + 1}).holds()) result.gaps.emplace_back(i, i + 1);
    }
    result.worldFromCamera = std::move(puzzle.rotation);
    level(result.worldFromCamera);
    result.joined = int(std::count_if(result.worldFromCamera.begin(), result.worldFromCamera.end(),
                                      [](const auto& r) { return r.has_value(); }));
    return result;
}

}  // namespace virga::environment
