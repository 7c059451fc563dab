#include "bench/Clip.h"

#include <algorithm>

#include "core/Error.h"

namespace virga::bench {
namespace {

ImageF averaged(const ImageF& image, int block)
{
    ImageF small(image.width() / block, image.height() / block, 4);
    for (int y = 0; y < small.height(); ++y)
        for (int x = 0; x < small.width(); ++x)
            for (int c = 0; c < 4; ++c) {
                double sum = 0;
                for (int j = 0; j < block; ++j)
                    for (int i = 0; i < block; ++i) sum += double(image.at(block * x + i, block * y + j, c));
                small.at(x, y, c) = float(sum / (block * block));
            }
    return small;
}

Clip clipOf(const std::string& name, const std::string& path, FrameNumber number, int columns)
{
    const auto reader = io::openPlate(path, {});
    std::optional<io::PlateFrame> frame = reader->read(number);
    if (!frame) throw Error(ErrorCode::Input, "{}: frame {} cannot be read", path, number);
    Clip clip{.name = name, .frame = std::move(*frame), .shot = {}, .settings = {}};
    clip.frame.pixels = averaged(clip.frame.pixels, std::max(1, clip.frame.pixels.width() / columns));
    clip.frame.extras.reset();
    clip.shot = {clip.frame.pixels.width(), clip.frame.pixels.height(), reader->info().fps, number};
    clip.settings.splashes = 0;
    return clip;
}

}  // namespace

std::vector<Clip> readClips(const std::string& samples, const std::string& footage, int columns)
{
    std::vector<Clip> clips;
    clips.push_back(clipOf("street", samples + "/street.mp4", 40, columns));
    shot::Settings& street = clips.back().settings;
    street.depth = samples + "/street_depth.####.exr";
    street.env = samples + "/street_env.exr";
    street.camera = samples + "/street.chan";
    street.fov_deg = 60;
    if (footage.empty()) return clips;
    clips.push_back(clipOf("yard", footage + "/clean-vtest/vtest_000-149.mp4", 20, columns));
    clips.back().settings.depth = footage + "/clean-vtest/ground_depth_m.exr";
    clips.push_back(clipOf("highway", footage + "/clean-highway/solidWhiteRight.mp4", 50, columns));
    clips.push_back(clipOf("balcony", footage + "/pan-street/street1.mp4", 100, columns));
    return clips;
}

}  // namespace virga::bench
