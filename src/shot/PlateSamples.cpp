#include "shot/PlateSamples.h"

#include <algorithm>
#include <cmath>

#include "core/Error.h"
#include "core/Log.h"
#include "core/Parallel.h"

namespace virga::shot {
namespace {

constexpr int lightColumns = 480;

/// Means over squares of whole pixels, at most `columns` of them side by side.
ImageF averagedDown(ConstImageViewF image, int columns)
{
    const int step = (image.width() + columns - 1) / columns;
    const int width = (image.width() + step - 1) / step, height = (image.height() + step - 1) / step;
    ImageF result(width, height, image.channels());
    parallelFor(0, height, 8, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y) {
            const int rows = std::min(step, image.height() - y * step);
            for (int x = 0; x < width; ++x) {
                const int cells = std::min(step, image.width() - x * step);
                float* sum = result.pixel(x, y);
                for (int j = 0; j < rows; ++j) {
                    const float* from = image.pixel(x * step, y * step + j);
                    for (int i = 0; i < cells * image.channels(); ++i) sum[i % image.channels()] += from[i];
                }
                for (int c = 0; c < image.channels(); ++c) sum[c] /= float(rows * cells);
            }
        }
    });
    return result;
}

}  // namespace

ImageF sampledForLight(const RowSource& plate)
{
    const int step = (plate.width() + lightColumns - 1) / lightColumns;
    const int width = (plate.width() + step - 1) / step, height = (plate.height() + step - 1) / step;
    ImageF result(width, height, 4);
    parallelFor(0, height, 16, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        ImageF row(plate.width(), 1, 4);
        for (int y = int(first); y < int(last); ++y) {
            plate.read(std::min(y * step + step / 2, plate.height() - 1), row);
            const ImageF mean = averagedDown(row, width);
            std::copy_n(mean.row(0), 4 * std::size_t(width), result.row(y));
        }
    });
    return result;
}

namespace {

std::vector<float> luminance(const ImageF& image)
{
    std::vector<float> result;
    for (int y = 0; y < image.height(); ++y) {
        for (int x = 0; x < image.width(); ++x) {
            const float* p = image.pixel(x, y);
            const float value = 0.2126f * p[0] + 0.7152f * p[1] + 0.0722f * p[2];
            result.push_back(std::isfinite(value) ? std::max(value, 0.0f) : 0.0f);
        }
    }
    return result;
}

double meanOf(const std::vector<float>& values)
{
    double sum = 0;
    for (const float value : values) sum += value;
    return sum / double(values.size());
}

/// Of at least one value, which are put out of order.
double medianOf(std::vector<double>& values)
{
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

}  // namespace

namespace {

std::set<std::size_t> spreadOver(std::size_t frames, std::size_t count)
{
    std::set<std::size_t> places;
    for (std::size_t i = 0; i < count; ++i) places.insert(count == 1 ? frames / 2 : i * (frames - 1) / (count - 1));
    return places;
}

}  // namespace

ImageF averagedForLight(const RowSource& plate)
{
    const int step = (plate.width() + lightColumns - 1) / lightColumns;
    ImageF result((plate.width() + step - 1) / step, (plate.height() + step - 1) / step, 4);
    parallelFor(0, result.height(), 4, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (auto y = int(first); y < int(last); ++y) {
            ImageF rows(plate.width(), std::min(step, plate.height() - y * step), 4);
            plate.read(y * step, rows);
            const ImageF mean = averagedDown(rows, lightColumns);
            std::copy_n(mean.row(0), 4 * std::size_t(result.width()), result.row(y));
        }
    });
    return result;
}

std::set<std::size_t> placesForLight(std::size_t frames, const Settings& settings)
{
    if (!settings.env.empty() || settings.envFrames <= 0) return {};
    return spreadOver(frames, std::size_t(settings.envFrames));
}

std::set<std::size_t> placesForGrade(std::size_t frames, const Settings& settings)
{
    if (settings.gradeFrom.empty()) return {};
    return spreadOver(frames, 3);
}

std::vector<FrameNumber> sampledFrames(const io::PlateInfo& plate, const Settings& settings)
{
    std::vector<FrameNumber> frames;
    std::set<std::size_t> places = placesForLight(plate.frames.size(), settings);
    places.merge(placesForGrade(plate.frames.size(), settings));
    for (const std::size_t place : places) frames.push_back(plate.frames[place]);
    return frames;
}

PlateSamples samplePlate(io::PlateReader& reader, const Settings& settings, bool light, bool standsStill)
{
    const std::vector<FrameNumber>& frames = reader.info().frames;
    const std::set<std::size_t> lit = light ? placesForLight(frames.size(), settings) : std::set<std::size_t>();
    const std::set<std::size_t> graded = placesForGrade(frames.size(), settings);
    std::set<std::size_t> all = lit;
    all.insert(graded.begin(), graded.end());
    // A grade is judged by whole pictures.
    reader.schedule({}, graded.empty() ? io::Pixels::Rows : io::Pixels::Light);
    PlateSamples samples;
    bool isSteadySoFar = true;
    std::string whyNot;
    for (const std::size_t place : all) {
        const bool isForGrade = graded.contains(place);
        if (!isSteadySoFar && !isForGrade) continue;
        try {
            std::optional<io::PlateFrame> frame = reader.read(frames[place]);
            if (!frame || !frame->repaired.empty()) continue;
            if (lit.contains(place) && isSteadySoFar) {
                samples.forLight.push_back({frames[place], frame->rows ? averagedForLight(*frame->rows)
                                                                       : averagedForLight(ImageRows(frame->pixels))});
                isSteadySoFar = !standsStill || isSteady(samples.forLight, whyNot);
            }
            if (isForGrade) samples.forGrade.push_back(std::move(frame->pixels));
        } catch (const Error& error) {  // named again if it is to be rendered
            log::detail("left out of the plate's light and grade: {}", error.what());
        }
    }
    reader.schedule({}, io::Pixels::Light);  // what it is read for next says its own
    return samples;
}

bool isSteady(const std::vector<PlateSamples::Frame>& frames, std::string& why)
{
    // Cells of a 48th of the width: grain and a locked camera's shake average out. Medians, as people walk and clouds
    // drift; but half of the picture is what it was.
    constexpr int columns = 48;
    constexpr double lightChange = 0.15, pictureChange = 0.05;
    std::vector<float> first;
    for (const PlateSamples::Frame& frame : frames) {
        const std::vector<float> now = luminance(averagedDown(frame.pixels, columns));
        if (first.empty()) first = now;
        const double mean = meanOf(first);
        std::vector<double> gain, difference;
        for (std::size_t k = 0; k < now.size(); ++k)
            if (first[k] > 0.1 * mean) gain.push_back(double(now[k]) / first[k]);
        const double light = gain.empty() ? 1 : medianOf(gain);
        if (std::abs(light - 1) > lightChange) {
            why = "its light changes";
            return false;
        }
        for (std::size_t k = 0; k < now.size(); ++k) difference.push_back(std::abs(now[k] - light * first[k]));
        if (medianOf(difference) > pictureChange * mean) {
            why = "the picture moves";
            return false;
        }
    }
    return true;
}

}  // namespace virga::shot
