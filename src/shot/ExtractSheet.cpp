#include "shot/ExtractSheet.h"

#include <algorithm>
#include <vector>

namespace virga::shot {
namespace {

constexpr int widest = 640;  // of a picture on the sheet [px]
constexpr int gap = 8;
constexpr float ground = 0.05f;

/// Reduced by whole steps, box-filtered; grey becomes RGB.
ImageF reduced(ConstImageViewF image)
{
    const int step = std::max(1, (image.width() + widest - 1) / widest);
    ImageF small(std::max(1, image.width() / step), std::max(1, image.height() / step), 3);
    for (int y = 0; y < small.height(); ++y)
        for (int x = 0; x < small.width(); ++x)
            for (int c = 0; c < 3; ++c) {
                float sum = 0, count = 0;
                for (int j = y * step; j < std::min(image.height(), (y + 1) * step); ++j)
                    for (int i = x * step; i < std::min(image.width(), (x + 1) * step); ++i) {
                        sum += image.at(i, j, image.channels() >= 3 ? c : 0);
                        count += 1;
                    }
                small.at(x, y, c) = sum / count;
            }
    return small;
}

void paste(ImageF& sheet, const ImageF& image, int left, int top)
{
    for (int y = 0; y < image.height(); ++y)
        std::copy_n(image.row(y), std::size_t(image.width()) * 3, sheet.pixel(left, top + y));
}

/// So bright that its 999th permille is white.
void stretch(ImageF& image)
{
    std::vector<float> values(image.values().begin(), image.values().end());
    const auto at = values.begin() + std::ptrdiff_t((values.size() - 1) * 999 / 1000);
    std::nth_element(values.begin(), at, values.end());
    const float white = std::max(*at, 1e-4f);
    for (float& value : image.values()) value = std::clamp(value / white, 0.0f, 1.0f);
}

}  // namespace

ImageF extractSheet(ConstImageViewF frame, ConstImageViewF alpha, ConstImageViewF plate, ConstImageViewF clean,
                    const matte::StrokeAtlas* atlas)
{
    std::vector<ImageF> pictures = {reduced(frame), reduced(alpha), reduced(plate), reduced(clean)};
    stretch(pictures[1]);
    const int width = pictures[0].width(), height = pictures[0].height(), across = 2 * width + gap;
    int columns = 0, rows = 0;
    if (atlas != nullptr) {
        columns = std::clamp((across + 2) / (atlas->width + 2), 1, atlas->count());
        rows = (atlas->count() + columns - 1) / columns;
    }
    const int tiles = rows * (atlas != nullptr ? atlas->height + 2 : 0);
    const int sheetWidth = atlas != nullptr ? std::max(across, columns * (atlas->width + 2)) : across;
    ImageF sheet(sheetWidth, 2 * height + gap + (tiles > 0 ? gap + tiles : 0), 3, ground);
    for (int n = 0; n < 4; ++n) paste(sheet, pictures[std::size_t(n)], n % 2 * (width + gap), n / 2 * (height + gap));
    for (int n = 0; atlas != nullptr && n < atlas->count(); ++n) {
        const ConstImageViewF tile = atlas->layer(n);
        const int left = n % columns * (atlas->width + 2), top = 2 * (height + gap) + n / columns * (atlas->height + 2);
        for (int y = 0; y < tile.height(); ++y)
            for (int x = 0; x < tile.width(); ++x)
                for (int c = 0; c < 3; ++c) sheet.at(left + x, top + y, c) = tile.at(x, y);
    }
    return sheet;
}

}  // namespace virga::shot
