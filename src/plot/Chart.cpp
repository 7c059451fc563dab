#include "plot/Chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

namespace virga::plot {
namespace {

constexpr double pageWidth = 760, chartHeight = 430, outlineHeight = 560;
constexpr double marginLeft = 78, marginRight = 26, marginBottom = 56;

// Told apart by most colour-blind readers, and by their lightness in print.
constexpr std::array<const char*, 7> palette{"#1f6fb4", "#d9622b", "#2a9d8f", "#8a56a8",
                                             "#c2931b", "#b83b5e", "#5b6770"};

std::string escaped(std::string_view text)
{
    std::string result;
    for (const char c : text) {
        switch (c) {
            case '&': result += "&amp;"; break;
            case '<': result += "&lt;"; break;
            case '>': result += "&gt;"; break;
            case '"': result += "&quot;"; break;
            default: result += c;
        }
    }
    return result;
}

/// Letters, not bytes.
std::size_t lengthOf(std::string_view text)
{
    return std::size_t(std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

/// A value as its axis counts: linear, decades or decibels. NaN where a logarithm has none.
double shown(double value, Scale scale)
{
    if (scale == Scale::Linear) return value;
    if (!(value > 0.0)) return std::numeric_limits<double>::quiet_NaN();
    return std::log10(value) * (scale == Scale::Decibel ? 10.0 : 1.0);
}

/// 1, 2 or 5 times a power of ten, at least `atLeast`.
double roundStep(double atLeast)
{
    const double power = std::pow(10.0, std::floor(std::log10(atLeast)));
    for (const double factor : {1.0, 2.0, 5.0}) {
        if (factor * power >= atLeast * (1.0 - 1e-9)) return factor * power;
    }
    return 10.0 * power;
}

/// The logarithm of 1, 2 or 5 times a power of ten next to `value`, itself a logarithm.
double roundLogarithm(double value, bool up)
{
    const double decade = std::floor(value + 1e-9);
    for (const double factor : {1.0, 2.0, 5.0, 10.0}) {
        const double here = decade + std::log10(factor);
        const double next = decade + std::log10(factor == 2.0 ? 5.0 : 2.0 * factor);
        if (up ? here >= value - 1e-9 : next > value + 1e-9) return here;
    }
    return decade + 1.0;
}

/// From and to, as the axis counts.
struct Range {
    double low, high;
    double size() const { return high - low; }
};

Range rangeOf(const std::vector<Series>& series, bool isX, const Axis& axis)
{
    Range range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    for (const Series& s : series) {
        for (const double value : isX ? s.x : s.y) {
            const double v = shown(value, axis.scale);
            if (!std::isfinite(v)) continue;
            range.low = std::min(range.low, v);
            range.high = std::max(range.high, v);
        }
    }
    if (!(range.low <= range.high)) range = {0.0, 1.0};
    if (axis.low) range.low = shown(*axis.low, axis.scale);
    if (axis.high) range.high = shown(*axis.high, axis.scale);
    if (!(range.size() > 1e-12 * std::max(std::abs(range.low), std::abs(range.high)))) {
        const double room = range.low == 0.0 ? 1.0 : 0.1 * std::abs(range.low);
        range = {range.low - room, range.low + room};
    }
    // Out to the next round number: 1, 2 or 5 in a decade, or of a quarter of a tick's distance, so that no chart is
    // half empty.
    if (axis.scale == Scale::Logarithmic) {
        if (!axis.low) range.low = roundLogarithm(range.low, false);
        if (!axis.high) range.high = roundLogarithm(range.high, true);
    } else {
        const double grain = (axis.tickStep > 0 ? axis.tickStep : roundStep(range.size() / 6.0)) / 4.0;
        if (!axis.low) range.low = grain * std::floor(range.low / grain + 1e-6);
        if (!axis.high) range.high = grain * std::ceil(range.high / grain - 1e-6);
    }
    return range;
}

/// One chart within the page: where values fall, and the elements drawn so far.
class Drawing {
public:
    Drawing(const Chart& chart, double top, double height) : chart_(chart), top_(top), height_(height)
    {
        for (const Series& s : chart.series) color_.push_back(!s.color.empty() ? s.color : palette[color_.size() % 7]);
        legend();
        plotBottom_ = top_ + height_ - marginBottom;
        plotTop_ = top_ + head_;
        x_ = rangeOf(chart.series, true, chart.x);
        y_ = rangeOf(chart.series, false, chart.y);
        if (chart.equalScales) equalise();
    }

    std::string elements()
    {
        titles();
        grid();
        curves();
        return out_;
    }

private:
    double width() const { return pageWidth - marginLeft - marginRight; }
    double placeX(double v) const { return marginLeft + (v - x_.low) / x_.size() * width(); }
    double placeY(double v) const { return plotBottom_ - (v - y_.low) / y_.size() * (plotBottom_ - plotTop_); }

    void equalise()
    {
        const double unit = std::max(x_.size() / width(), y_.size() / (plotBottom_ - plotTop_));
        const auto widen = [](Range& range, double size) {
            const double middle = 0.5 * (range.low + range.high);
            range = {middle - 0.5 * size, middle + 0.5 * size};
        };
        widen(x_, unit * width());
        widen(y_, unit * (plotBottom_ - plotTop_));
    }

    /// Lays the legend out in rows above the plot, which begins below them.
    void legend()
    {
        double x = marginLeft, y = top_ + (chart_.subtitle.empty() ? 62 : 82);
        bool any = false;
        for (std::size_t i = 0; i < chart_.series.size(); ++i) {
            const Series& s = chart_.series[i];
            if (s.name.empty()) continue;
            const double size = 34 + 6.5 * double(lengthOf(s.name)) + 18;
            if (x + size > pageWidth - marginRight + 18 && x > marginLeft) {
                x = marginLeft;
                y += 20;
            }
            any = true;
            if (s.line)
                out_ += fmt::format("<path class=\"line\" stroke=\"{}\"{} d=\"M{:.1f} {:.1f}h24\"/>\n", color_[i],
                                    dashes(s), x, y - 4);
            if (s.markers)
                out_ += fmt::format("<circle fill=\"{}\" r=\"3\" cx=\"{:.1f}\" cy=\"{:.1f}\"/>\n", color_[i], x + 12,
                                    y - 4);
            out_ +=
                fmt::format("<text class=\"key\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", x + 32, y, escaped(s.name));
            x += size;
        }
        head_ = any ? y - top_ + 16 : (chart_.subtitle.empty() ? 52 : 72);
    }

    void titles()
    {
        out_ += fmt::format("<text class=\"title\" x=\"{:.0f}\" y=\"{:.1f}\">{}</text>\n", marginLeft, top_ + 34,
                            escaped(chart_.title));
        if (!chart_.subtitle.empty())
            out_ += fmt::format("<text class=\"subtitle\" x=\"{:.0f}\" y=\"{:.1f}\">{}</text>\n", marginLeft, top_ + 54,
                                escaped(chart_.subtitle));
        out_ += fmt::format("<text class=\"label\" x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n",
                            marginLeft + 0.5 * width(), plotBottom_ + 42, escaped(chart_.x.label));
        const double middle = 0.5 * (plotTop_ + plotBottom_);
        out_ += fmt::format(
            "<text class=\"label\" transform=\"translate(22 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
            middle, escaped(chart_.y.label));
    }

    static std::vector<double> places(const Axis& axis, const Range& range, int most, double& step)
    {
        std::vector<double> result;
        if (axis.tickStep > 0 && axis.scale == Scale::Linear) {
            step = axis.tickStep;
            for (double i = std::ceil(range.low / step - 1e-9); i * step <= range.high + 1e-9 * step; ++i)
                result.push_back(i * step);
        } else {
            result = ticks(range.low, range.high, axis.scale, most);
            step = result.size() > 1 ? result[1] - result[0] : 1.0;
        }
        return result;
    }

    void grid()
    {
        double step = 1.0;
        for (const double v : places(chart_.x, x_, 8, step)) {
            out_ +=
                fmt::format("<path class=\"grid\" d=\"M{:.1f} {:.1f}V{:.1f}\"/>\n", placeX(v), plotTop_, plotBottom_);
            out_ += fmt::format("<text class=\"tick\" x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n",
                                placeX(v), plotBottom_ + 19, tickLabel(v, step, chart_.x.scale));
        }
        for (const double v : places(chart_.y, y_, chart_.y.scale == Scale::Logarithmic ? 9 : 7, step)) {
            out_ += fmt::format("<path class=\"grid\" d=\"M{:.0f} {:.1f}H{:.0f}\"/>\n", marginLeft, placeY(v),
                                pageWidth - marginRight);
            out_ += fmt::format("<text class=\"tick\" x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>\n",
                                marginLeft - 8, placeY(v) + 4, tickLabel(v, step, chart_.y.scale));
        }
        out_ += fmt::format("<path class=\"axis\" d=\"M{:.0f} {:.1f}V{:.1f}H{:.0f}\"/>\n", marginLeft, plotTop_,
                            plotBottom_, pageWidth - marginRight);
    }

    static const char* dashes(const Series& s) { return s.dashed ? " stroke-dasharray=\"6 4\"" : ""; }

    void curves()
    {
        const std::string clip = fmt::format("plot{:.0f}", top_);
        out_ += fmt::format(
            "<clipPath id=\"{}\"><rect x=\"{:.0f}\" y=\"{:.1f}\" width=\"{:.0f}\" height=\"{:.1f}\"/></clipPath>\n"
            "<g clip-path=\"url(#{})\">\n",
            clip, marginLeft - 1, plotTop_ - 1, width() + 2, plotBottom_ - plotTop_ + 2, clip);
        std::string dots;  // whole, also on the plot's edge
        for (std::size_t i = 0; i < chart_.series.size(); ++i) {
            const Series& s = chart_.series[i];
            std::string path, points;
            bool drawing = false;
            for (std::size_t k = 0; k < std::min(s.x.size(), s.y.size()); ++k) {
                const double x = placeX(shown(s.x[k], chart_.x.scale)), y = placeY(shown(s.y[k], chart_.y.scale));
                if (!std::isfinite(x) || !std::isfinite(y)) {
                    drawing = false;
                    continue;
                }
                // Far outside is as good as just outside, and short.
                const double px = std::clamp(x, -2.0 * pageWidth, 3.0 * pageWidth);
                const double py = std::clamp(y, plotTop_ - 4.0 * height_, plotBottom_ + 4.0 * height_);
                path += fmt::format("{}{:.2f} {:.2f}", drawing ? "L" : "M", px, py);
                const bool isInside = x >= marginLeft - 1 && x <= pageWidth - marginRight + 1 && y >= plotTop_ - 1 &&
                                      y <= plotBottom_ + 1;
                if (s.markers && isInside)
                    points += fmt::format("<circle r=\"3\" cx=\"{:.2f}\" cy=\"{:.2f}\"/>", px, py);
                drawing = true;
            }
            if (s.line && !path.empty())
                out_ += fmt::format("<path class=\"line\" stroke=\"{}\"{} d=\"{}\"/>\n", color_[i], dashes(s), path);
            if (!points.empty()) dots += fmt::format("<g fill=\"{}\">{}</g>\n", color_[i], points);
        }
        out_ += "</g>\n" + dots;
    }

    const Chart& chart_;
    double top_, height_, head_ = 0, plotTop_ = 0, plotBottom_ = 0;
    Range x_{}, y_{};
    std::vector<std::string> color_;
    std::string out_;
};

}  // namespace

std::vector<double> ticks(double low, double high, Scale scale, int most)
{
    std::vector<double> result;
    if (scale == Scale::Logarithmic && high - low > 1.0) {
        // Whole decades; 1, 2 and 5 of each if that is not too many.
        const int first = int(std::floor(low)), last = int(std::ceil(high));
        const bool hasRoom = 3.0 * (high - low) <= most;
        const double step = std::max(1.0, std::ceil((std::floor(high + 1e-9) - std::ceil(low - 1e-9)) / (most - 1)));
        for (int decade = first; decade <= last; ++decade) {
            for (const double factor : {1.0, 2.0, 5.0}) {
                const double place = decade + std::log10(factor);
                if (place < low - 1e-9 || place > high + 1e-9 || (factor != 1.0 && !hasRoom)) continue;
                if (factor == 1.0 && std::remainder(decade, step) != 0.0) continue;
                result.push_back(place);
            }
        }
        return result;
    }
    if (scale == Scale::Logarithmic) {
        // Within a decade: round values, at their logarithms.
        for (const double value : ticks(std::pow(10.0, low), std::pow(10.0, high), Scale::Linear, most))
            if (value > 0.0) result.push_back(std::log10(value));
        return result;
    }
    const double step = roundStep((high - low) / (most - 1));
    for (double i = std::ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; ++i) result.push_back(i * step);
    return result;
}

std::string tickLabel(double value, double step, Scale scale)
{
    if (scale == Scale::Logarithmic) {
        if (value > -3.5 && value < 5.2) return fmt::format("{:.6g}", std::pow(10.0, value));
        const int exponent = int(std::floor(value + 1e-9));
        const std::string factor = fmt::format("{:.3g}", std::pow(10.0, value - exponent));
        static constexpr std::array<const char*, 10> digits{"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
        std::string text = (factor == "1" ? "10" : factor + "·10") + (exponent < 0 ? "⁻" : "");
        for (const char c : std::to_string(std::abs(exponent))) text += digits[std::size_t(c - '0')];
        return text;
    }
    if (std::abs(value) < 1e-9 * step) return "0";
    const double largest = std::max(std::abs(value), step);
    if (largest >= 1e6 || largest < 1e-3) return fmt::format("{:.4g}", value);
    const int decimals = std::clamp(int(std::ceil(-std::log10(step) - 1e-9)), 0, 9);
    std::string text = fmt::format("{:.{}f}", value, decimals);
    // A step of 0.25 needs one digit more than its first.
    if (std::abs(std::stod(text) - value) > 1e-3 * step) text = fmt::format("{:.{}f}", value, decimals + 1);
    if (text.starts_with('-')) text.replace(0, 1, "−");
    return text;
}

std::string svg(std::span<const Chart> charts)
{
    double height = 0;
    std::string body;
    for (const Chart& chart : charts) {
        const double size = chart.equalScales ? outlineHeight : chartHeight;
        body += Drawing(chart, height, size).elements();
        height += size;
    }
    return fmt::format(
               "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" "
               "height=\"{1:.0f}\" font-family=\"Helvetica Neue, Helvetica, Arial, Liberation Sans, sans-serif\">\n",
               pageWidth, height) +
           "<style>\n"
           ".title { font-size: 18px; font-weight: 600; fill: #1d2733 }\n"
           ".subtitle { font-size: 13px; fill: #5a6673 }\n"
           ".label { font-size: 13px; fill: #3a4653 }\n"
           ".key { font-size: 13px; fill: #1d2733 }\n"
           ".tick { font-size: 12px; fill: #5a6673 }\n"
           ".grid { stroke: #e3e8ee; stroke-width: 1; fill: none }\n"
           ".axis { stroke: #8794a1; stroke-width: 1; fill: none }\n"
           ".line { stroke-width: 2; stroke-linejoin: round; stroke-linecap: round; fill: none }\n"
           "</style>\n" +
           fmt::format("<rect width=\"{:.0f}\" height=\"{:.0f}\" rx=\"8\" fill=\"#ffffff\"/>\n", pageWidth, height) +
           body + "</svg>\n";
}

}  // namespace virga::plot
