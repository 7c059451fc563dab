#include "shot/ContactSheet.h"

#include <algorithm>

#include "io/Plate.h"

namespace virga::shot {
namespace {

constexpr std::size_t rows = 3;
constexpr int widest = 960;  // of a picture on the sheet [px]
constexpr int gap = 8;

/// Reduced by whole steps, box-filtered in linear light, alpha dropped.
ImageF reduced(ConstImageViewF image)
{
    const int step = (image.width() + widest - 1) / widest;
    ImageF small(image.width() / step, image.height() / step, 3);
    for (int y = 0; y < small.height(); ++y)
        for (int x = 0; x < small.width(); ++x)
            for (int c = 0; c < 3; ++c) {
                float sum = 0;
                for (int j = 0; j < step; ++j)
                    for (int i = 0; i < step; ++i) sum += image.at(x * step + i, y * step + j, c);
                small.at(x, y, c) = sum / float(step * step);
            }
    return small;
}

void paste(ImageF& sheet, const ImageF& image, int left, int top)
{
    for (int y = 0; y < image.height(); ++y)
        std::copy_n(image.row(y), std::size_t(image.width()) * 3, sheet.pixel(left, top + y));
}

}  // namespace

ContactSheet::ContactSheet(std::string path, const std::vector<FrameNumber>& frames) : path_(std::move(path))
{
    if (path_.empty() || frames.empty()) return;
    const std::size_t count = std::min(rows, frames.size());
    for (std::size_t i = 0; i < count; ++i) frames_.push_back(frames[(2 * i + 1) * frames.size() / (2 * count)]);
}

bool ContactSheet::isWanted(FrameNumber frame) const
{
    return std::find(frames_.begin(), frames_.end(), frame) != frames_.end();
}

void ContactSheet::addBefore(FrameNumber frame, ConstImageViewF plate)
{
    if (isWanted(frame)) before_[frame] = reduced(plate);
}

void ContactSheet::addAfter(FrameNumber frame, ConstImageViewF beauty)
{
    if (isWanted(frame)) after_[frame] = reduced(beauty);
}

void ContactSheet::write(const io::PlateInfo& plate) const
{
    if (after_.empty()) return;
    const int width = after_.begin()->second.width(), height = after_.begin()->second.height();
    ImageF sheet(2 * width + gap, int(after_.size()) * (height + gap) - gap, 3, 0.2f);
    int top = 0;
    for (const auto& [frame, after] : after_) {
        paste(sheet, before_.at(frame), 0, top);
        paste(sheet, after, width + gap, top);
        top += height + gap;
    }
    io::writePng(path_, sheet, *plate.colors, plate.workingColorspace);
}

}  // namespace virga::shot
