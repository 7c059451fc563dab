#include "matte/RainEstimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/Error.h"
#include "rainfall/DropSizes.h"
#include "rainfall/TerminalSpeed.h"

namespace virga::matte {
namespace {

constexpr double kPi = std::numbers::pi;

// Half maximum of a drop's profile across, as shares of its diameter: a disc's chord has 0.87, the parabola that stands
// for it in `virga rain` 0.71.
constexpr double kAcrossShape = 0.75;
// Integral across / (width at half maximum x mean over the middle half of it): 0.98 for a parabola, 1.13 for a
// Gaussian, 1.14 for a triangle.
constexpr double kMass = 1.08;

// Standard deviations of the logarithms of what is found about what the drop leaves: noise, and faint neighbours.
constexpr double kContrastScatter = 0.2, kLengthScatter = 0.1;
constexpr double kMargin = 1.25;     // of the limits: so far over them the finder misses nothing
constexpr double kElongation = 2.5;  // 2 in the finder, with that margin
constexpr double kSnow = 3.5;        // median elongation below which it is no rain
constexpr double kLongest = 0.5;     // of the way through the picture: longer ones are seldom whole
constexpr std::size_t kLeastStrokes = 8;
constexpr double kResolved = 1.2;                          // width / blur from which (2) says something
constexpr double kUsualOpacity = 5, kOpacityDoubt = 0.55;  // of log o: a range of 2 to 12.5
constexpr double kLeastRate = 0.01, kMostRate = 1000;      // [mm/h]
constexpr double kLeastOpacity = 0.05, kMostOpacity = 100;
constexpr double kShortest = 1e-5, kLongestExposure = 1;  // [s]
constexpr double kLeastSharp = 0.5;                       // w^2 / (w^2 + c^2), whatever the lens is said to do
constexpr double kWidest = 0.05, kWidestLeast = 16;       // share and number of the strokes that tell the opacity
constexpr double kSmallestDrop = 3e-4;                    // [m], smaller ones are never seen singly
constexpr double kSteepest = 1.3;                         // slant [rad] beyond which wind is not told from turbulence
constexpr double kSettled = 1e-5;                         // of the logarithms
constexpr double kTwoSided = 1.645;                       // standard deviations, 90 %

double quantileOf(std::vector<double> values, double share)
{
    const auto at = values.begin() + std::ptrdiff_t(share * double(values.size()));
    std::nth_element(values.begin(), at, values.end());
    return *at;
}
double medianOf(std::vector<double> values) { return quantileOf(std::move(values), 0.5); }

// Standard deviation of the median of these logarithms.
double medianDoubt(const std::vector<double>& logs)
{
    const double median = medianOf(logs);
    std::vector<double> off;
    for (const double value : logs) off.push_back(std::abs(value - median));
    return 1.253 * 1.4826 * medianOf(std::move(off)) / std::sqrt(double(logs.size()));
}

// Share of a normal distribution below t standard deviations.
double normalShare(double t) { return 0.5 * std::erfc(-t / std::numbers::sqrt2); }

struct Lens {
    double focal, aperture, focus;
    double confusion(double inverseDepth) const { return focal * aperture * std::abs(inverseDepth - 1 / focus); }
};

struct Limits {
    double contrast, shortest, longest, widest, near, far, blur;
    bool holdShape(double length, double width) const
    {
        return length <= longest && width <= widest && length >= kElongation * width;
    }
    bool hold(const RainStroke& s) const
    {
        return s.contrast >= contrast && s.length >= shortest && holdShape(s.length, s.width);
    }
};

// What the picture shows of the rain through a shutter: the strokes that count, by diameter and depth.
class View {
public:
    View(const Lens& lens, const Limits& limits, double exposure, double opacity)
    {
        constexpr int depths = 64;
        for (std::size_t i = 0; i < kSizes; ++i) {
            const double d = diameter(i), path = speeds()[i] * exposure * lens.focal;
            const double first = std::max(limits.near, path / limits.longest);
            const double last = std::min(limits.far, path / limits.shortest * std::exp(3 * kLengthScatter));
            if (!(last > first)) continue;
            const double step = std::log(last / first) / depths;
            for (int k = 0; k < depths; ++k) {
                const double z = first * std::exp((k + 0.5) * step);
                const double drop = d * lens.focal / z, length = path / z;
                const double full = std::hypot(drop, lens.confusion(1 / z));
                const double width = std::hypot(kAcrossShape * full, limits.blur);
                const double contrast = opacity * kPi / 4 * drop * drop / (kMass * width * length);
                if (!limits.holdShape(length, width)) continue;
                // How many are found over a limit, and by how much the brighter ones among equals are favoured.
                const double over = std::log(std::min(contrast, 1.0) / limits.contrast) / kContrastScatter;
                const double volume = step * z * z * z / (lens.focal * lens.focal) *
                                      normalShare(std::log(length / limits.shortest) / kLengthScatter);
                volume_[i] += volume * normalShare(over);
                parts_.push_back({i, volume * normalShare(over), drop});
                favour_[i] += volume * kContrastScatter * std::exp(-0.5 * over * over) / std::sqrt(2 * kPi);
            }
        }
    }

    /// Strokes a frame a pixel.
    double density(double rate) const
    {
        const auto number = numbers(rate);
        double sum = 0;
        for (std::size_t i = 0; i < kSizes; ++i) sum += number[i] * volume_[i];
        return sum;
    }

    /// By how much the contrasts of those that are found exceed those of their drops, mean of the logarithm.
    double favour(double rate) const
    {
        const auto number = numbers(rate);
        double sum = 0, all = 0;
        for (std::size_t i = 0; i < kSizes; ++i) sum += number[i] * favour_[i], all += number[i] * volume_[i];
        return all > 0 ? sum / all : 0;
    }

    /// The rate of that density, within kLeastRate to kMostRate.
    double rate(double density) const
    {
        double low = std::log(kLeastRate), high = std::log(kMostRate);
        for (int i = 0; i < 40; ++i) {
            const double middle = 0.5 * (low + high);
            (this->density(std::exp(middle)) < density ? low : high) = middle;
        }
        return std::exp(0.5 * (low + high));
    }

    /// Median diameter of the strokes that count; 0 if the view holds none.
    double medianDiameter(double rate) const
    {
        const auto number = numbers(rate);
        double total = density(rate), sum = 0;
        for (std::size_t i = 0; i < kSizes; ++i)
            if (sum += number[i] * volume_[i]; total > 0 && 2 * sum >= total) return diameter(i);
        return 0;
    }

    /// Median diameter of the drops whose pictures are the widest, a share of all; 0 if the view holds none.
    double widestDiameter(double rate, double share) const
    {
        const auto number = numbers(rate);
        std::vector<Part> widest = parts_;
        std::sort(widest.begin(), widest.end(), [](const Part& a, const Part& b) { return a.width > b.width; });
        const double wanted = share * density(rate);
        std::array<double, kSizes> among{};
        double sum = 0, half = 0;
        for (const Part& part : widest) {
            if (sum >= wanted) break;
            const double strokes = number[part.size] * part.volume;
            sum += strokes, among[part.size] += strokes;
        }
        for (std::size_t i = 0; i < kSizes; ++i)
            if (half += among[i]; sum > 0 && 2 * half >= sum) return diameter(i);
        return 0;
    }

private:
    struct Part {
        std::size_t size;      // index of the diameter
        double volume, width;  // as in volume_; of the drop's picture [px]
    };
    static constexpr std::size_t kSizes = 64;
    static double logStep() { return std::log(rainfall::DropSizes::breakUpDiameter / kSmallestDrop) / double(kSizes); }
    static double diameter(std::size_t i) { return kSmallestDrop * std::exp((double(i) + 0.5) * logStep()); }

    static const std::array<double, kSizes>& speeds()
    {
        static const std::array<double, kSizes> all = [] {
            std::array<double, kSizes> of;
            for (std::size_t i = 0; i < kSizes; ++i) of[i] = rainfall::terminalSpeed(diameter(i));
            return of;
        }();
        return all;
    }

    /// Drops a cubic metre.
    static std::array<double, kSizes> numbers(double rate)
    {
        const rainfall::DropSizes sizes(rate);
        std::array<double, kSizes> all;
        for (std::size_t i = 0; i < kSizes; ++i) all[i] = sizes.density(diameter(i)) * diameter(i) * logStep();
        return all;
    }

    std::array<double, kSizes> volume_{};  // of a pixel's view in which a drop's stroke counts [m^3]
    std::vector<Part> parts_;
    std::array<double, kSizes> favour_{};  // times what chance adds to the logarithm of its contrast
};

// A stroke in the words of the model.
struct Measured {
    double length, width, disc;  // [px], [px], 4 m L / pi = o w^2 [px^2]
};

void check(int width, int height, int frames, const RainEstimateOptions& o)
{
    if (width < 1 || height < 1 || frames < 1)
        throw Error(ErrorCode::Internal, "rain in {} frames of {}x{}: there must be one at least", frames, width,
                    height);
    const auto positive = [](const char* name, double value, bool orZero = false) {
        if (!(value > 0 || (orZero && value == 0)) || !std::isfinite(value))
            throw Error(ErrorCode::InvalidArgument, "{} of the rain's estimate is {}: must be {}", name, value,
                        orZero ? "0 or more" : "over 0");
    };
    positive("the focal length", o.focal_px, true);
    positive("the least depth", o.near_m);
    positive("the greatest depth", o.far_m);
    positive("the aperture", o.aperture_m, true);
    positive("the distance in focus", o.focus_m);
    positive("the frame rate", o.fps, true);
    positive("the least contrast", o.minContrast);
    positive("the least length", o.minLength);
    positive("the greatest width", o.maxWidth);
    positive("the blur", o.blur_px);
    if (o.far_m <= o.near_m)
        throw Error(ErrorCode::InvalidArgument, "the rain's greatest depth {} m must be over the least, {} m", o.far_m,
                    o.near_m);
}

bool isUsable(const RainStroke& s, double diagonal)
{
    const auto within = [](double value, double most) { return value > 0 && value <= most; };
    return s.inside && within(s.length, diagonal) && within(s.width, diagonal) && within(s.mean, 2) &&
           within(s.contrast, 2) && std::abs(s.slant) <= kPi && std::isfinite(s.score);
}

// The strokes with the most mass are those of the widest drops, in focus or not; their width alone, which noise and
// neighbours enlarge, would choose others.
class WidestStrokes {
public:
    WidestStrokes(std::vector<Measured> strokes, double blur)
    {
        share_ = std::clamp(kWidestLeast / double(strokes.size()), kWidest, 1.0);
        std::sort(strokes.begin(), strokes.end(), [](const Measured& a, const Measured& b) { return a.disc > b.disc; });
        strokes.resize(std::size_t(std::ceil(share_ * double(strokes.size()))));
        std::vector<double> discs, widths, lengths, logs;
        for (const Measured& s : strokes) {
            discs.push_back(s.disc), widths.push_back(s.width), lengths.push_back(s.length);
            logs.push_back(std::log(s.width));
        }
        disc_ = medianOf(discs), length_ = medianOf(lengths);
        const double width = medianOf(widths);
        resolved_ = width >= kResolved * blur;
        full_ = (width * width - blur * blur) / (kAcrossShape * kAcrossShape);
        doubt_ = 2 * medianDoubt(logs) * width * width / (width * width - blur * blur);
    }

    /// Wide enough for equation (2).
    bool areResolved() const { return resolved_; }
    /// Of the strokes that were given.
    double share() const { return share_; }
    /// Of log o, from the scatter of what is measured.
    double doubt() const { return doubt_; }
    /// path: length x depth [px m].
    double opacity(const Lens& lens, double path) const
    {
        const double confusion = lens.confusion(length_ / path);
        return disc_ / std::max(full_ - confusion * confusion, kLeastSharp * full_);
    }

private:
    double share_, disc_, length_, full_, doubt_;  // medians: o w^2, L, w^2 + c^2
    bool resolved_;
};

}  // namespace

RainEstimate estimateRain(std::span<const RainStroke> strokes, int width, int height, int frames,
                          const RainEstimateOptions& options)
{
    check(width, height, frames, options);
    const double focal = options.focal_px > 0 ? options.focal_px : 0.5 * width / std::tan(kPi / 6);
    const Lens lens{focal, options.aperture_m, options.focus_m};

    std::vector<RainStroke> usable;
    std::vector<double> contrasts;
    for (const RainStroke& s : strokes)
        if (isUsable(s, std::hypot(width, height))) usable.push_back(s), contrasts.push_back(s.contrast);
    if (usable.size() < kLeastStrokes) return {};
    const double slant = rainStatistics(usable, {}).slant;
    const double c = std::abs(std::cos(slant)), sn = std::abs(std::sin(slant));

    Limits limits;
    limits.contrast = kMargin * std::max(options.minContrast, quantileOf(contrasts, 0.1));
    limits.shortest = kMargin * options.minLength;
    limits.longest = kLongest * std::min(width / std::max(sn, 1e-9), height / std::max(c, 1e-9));
    limits.widest = options.maxWidth;
    limits.near = options.near_m, limits.far = options.far_m;
    limits.blur = options.blur_px;

    // Horvitz and Thompson 1952: a stroke that fits into a share of the picture stands for the inverse of that share.
    double density = 0;
    std::vector<RainStroke> counted;
    for (const RainStroke& s : usable) {
        if (!limits.hold(s)) continue;
        const double room = 1.5 * options.blur_px;
        const double roomX = width - s.length * sn - s.width * c - room;
        const double roomY = height - s.length * c - s.width * sn - room;
        if (!(roomX > 0 && roomY > 0)) continue;
        density += 1 / (roomX * roomY) / frames;
        counted.push_back(s);
    }
    if (counted.size() < kLeastStrokes) return {};

    std::vector<double> scores, elongations;
    for (const RainStroke& s : counted) scores.push_back(s.score), elongations.push_back(s.length / s.width);
    if (medianOf(elongations) < kSnow) return {};
    const double fair = medianOf(scores);
    std::vector<Measured> better;
    for (const RainStroke& s : counted)
        if (s.score >= fair) better.push_back({s.length, s.width, 4 / kPi * kMass * s.mean * s.width * s.length});

    const WidestStrokes widest(better, options.blur_px);
    // What is measured and what is usual, each as far as it is sure; 0.3: what is not known of lens, profile and blur.
    const double measuredDoubt = widest.areResolved() ? std::hypot(widest.doubt(), 0.3) : 1e3;
    const double opacityDoubt = 1 / std::hypot(1 / measuredDoubt, 1 / kOpacityDoubt);
    std::vector<double> lengths;
    for (const Measured& s : better) lengths.push_back(std::log(s.length / std::sqrt(s.disc)));
    const double medianLength = std::exp(medianOf(lengths));

    // A drop that drifts goes a way longer by 1 / cos(slant): as if the shutter had been open longer.
    const double falling = std::cos(std::clamp(slant, -kSteepest, kSteepest));

    // Exposure, opacity and rate hang together through the drops that show and the blur of near ones.
    double exposure = 0.005, opacity = kUsualOpacity, rate = 25, diameter = 1.5e-3;
    for (int i = 0; i < 40; ++i) {
        const double before = exposure, opacityBefore = opacity;
        const View view(lens, limits, exposure, opacity);
        rate = view.rate(density);
        if (const double d = view.medianDiameter(rate); d > 0) diameter = d;
        const double favour = view.favour(rate);
        double logOpacity = std::log(kUsualOpacity);
        if (widest.areResolved()) {
            const double d = std::max(view.widestDiameter(rate, widest.share()), kSmallestDrop);
            const double speed = rainfall::terminalSpeed(d);
            const double own = std::log(widest.opacity(lens, speed * exposure * focal)) - favour;
            logOpacity += (own - logOpacity) * std::pow(opacityDoubt / measuredDoubt, 2);
        }
        opacity = std::sqrt(opacity * std::clamp(std::exp(logOpacity), kLeastOpacity, kMostOpacity));
        const double found =
            medianLength * std::sqrt(opacity * std::exp(favour)) * diameter / rainfall::terminalSpeed(diameter);
        exposure = std::clamp(std::sqrt(exposure * found), kShortest, kLongestExposure);
        if (std::abs(std::log(exposure / before)) < kSettled && std::abs(std::log(opacity / opacityBefore)) < kSettled)
            break;
    }
    // No rain has so many strokes.
    if (rate > 0.99 * kMostRate) return {};

    // 0.15: D / v of drops twice as large; 0.1: lengths and masses as found.
    const double ownDoubt = std::hypot(medianDoubt(lengths), 0.15, 0.1);
    const double exposureDoubt = std::hypot(ownDoubt, opacityDoubt / 2);
    const double countDoubt = std::hypot(1 / std::sqrt(double(counted.size())), 0.2);
    const double limitDoubt = 0.2;  // of the contrast from which strokes are found
    const auto rateOf = [&](double logExposure, double logOpacity, double logDensity) {
        return View(lens, limits, exposure * std::exp(logExposure), opacity * std::exp(logOpacity))
            .rate(density * std::exp(logDensity));
    };
    const auto spread = [&](double logExposure, double logOpacity, double logDensity) {
        return 0.5 * std::abs(std::log(rateOf(logExposure, logOpacity, logDensity) /
                                       rateOf(-logExposure, -logOpacity, -logDensity)));
    };
    // The exposure follows the root of the opacity, whose error moves both.
    const double rateDoubt = std::hypot(std::hypot(spread(0, 0, countDoubt), spread(0, limitDoubt, 0)),
                                        spread(ownDoubt, 0, 0), spread(opacityDoubt / 2, opacityDoubt, 0));

    RainEstimate e;
    e.found = true;
    const auto around = [](double value, double doubt, double& low, double& high) {
        const double factor = std::exp(kTwoSided * doubt);
        low = value / factor, high = value * factor;
        return value;
    };
    e.rate_mm_h = around(rate, rateDoubt, e.rateLow, e.rateHigh);
    e.exposure_s = around(exposure * falling, exposureDoubt, e.exposureLow, e.exposureHigh);
    e.opacity = around(opacity, opacityDoubt, e.opacityLow, e.opacityHigh);
    if (options.fps > 0)
        for (double* value : {&e.exposure_s, &e.exposureLow, &e.exposureHigh})
            *value = std::min(*value, 1 / options.fps);
    e.opacityMeasured = widest.areResolved();
    e.diameter_m = diameter;
    e.wind_m_s = rainfall::terminalSpeed(diameter) * std::tan(std::clamp(slant, -kSteepest, kSteepest));
    e.density = density * 1e6;
    e.counted = int(counted.size());
    return e;
}

}  // namespace virga::matte
