#include "shot/ExtractSurvey.h"

#include <algorithm>
#include <vector>

#include "matte/FrameAlignment.h"

namespace virga::shot {
namespace {

// Of a camera that stands: registration of three frames is good to 0.3 px where they are large, to 2.4 px where they
// are 96 x 96 under rain.
constexpr double mostMotion_px = 1.0, mostMotionOfSmall_px2 = 250;
constexpr int judgedWidth = 400;  // [px], of the frames that this is found from, at least
constexpr double fewestInliers = 0.5;
constexpr std::size_t judgedColumns = 200;  // of the frames that tell in which space the model fits

/// Every n-th column and row, so that about judgedColumns are left.
ImageF thinned(const ImageF& image)
{
    const int step = std::max(1, image.width() / int(judgedColumns));
    ImageF thin((image.width() + step - 1) / step, (image.height() + step - 1) / step, image.channels());
    for (int y = 0; y < thin.height(); ++y)
        for (int x = 0; x < thin.width(); ++x)
            std::copy_n(image.pixel(x * step, y * step), image.channels(), thin.pixel(x, y));
    return thin;
}

/// Averaged over `step` x `step` pixels, so that it is judgedWidth wide or more.
ImageF reduced(const ImageF& image, int& step)
{
    step = std::max(1, image.width() / judgedWidth);
    ImageF small(image.width() / step, std::max(1, image.height() / step), image.channels());
    for (int y = 0; y < small.height(); ++y)
        for (int x = 0; x < small.width(); ++x)
            for (int j = 0; j < small.channels(); ++j) {
                float sum = 0.0f;
                for (int v = 0; v < step; ++v)
                    for (int u = 0; u < step; ++u)
                        sum += image.at(x * step + u, std::min(image.height() - 1, y * step + v), j);
                small.at(x, y, j) = sum / float(step * step);
            }
    return small;
}

}  // namespace

SpaceChoice chooseSpace(const ExtractJobOptions& job, bool isFloat, std::span<const ImageF> linearFrames)
{
    SpaceChoice choice;
    if (const std::optional<ModelSpace> asked = modelSpaceNamed(job.space)) return {*asked, {}, {}, "--space"};
    if (job.linear) return {ModelSpace::Linear, {}, {}, "--linear"};
    std::vector<ImageF> thin;
    for (const ImageF& frame : linearFrames) thin.push_back(thinned(frame));
    choice.linear = noiseUnevenness(thin);
    for (ImageF& frame : thin) toModel(frame, ModelSpace::Display);
    choice.display = noiseUnevenness(thin);
    const bool isKnown = choice.linear && choice.display;
    if (isKnown) {
        choice.space = *choice.display < *choice.linear ? ModelSpace::Display : ModelSpace::Linear;
        choice.why = "its noise is the more even";
    } else {
        choice.space = isFloat ? ModelSpace::Linear : ModelSpace::Display;
        choice.why = "no noise to judge by; as the file is";
    }
    return choice;
}

CameraJudgement judgeCamera(std::span<const ImageF> linearFrames)
{
    CameraJudgement judgement;
    if (linearFrames.size() < 3) return judgement;
    std::vector<ImageF> frames;
    int step = 1;
    for (const std::size_t k : {std::size_t(0), linearFrames.size() / 2, linearFrames.size() - 1}) {
        frames.push_back(reduced(linearFrames[k], step));
        toModel(frames.back(), ModelSpace::Display);
    }
    // What is asked is whether it moves by a pixel.
    matte::AlignmentOptions options;
    options.mostFeatures = 300;
    options.polishes = 0;
    for (const matte::FrameAlignment& place : matte::alignFrames(frames, 1, options)) {
        judgement.isLost |= !place.found;
        if (place.found && place.inlierShare > fewestInliers)
            judgement.motion_px = std::max(judgement.motion_px, step * place.motion_px);
    }
    const double size = std::min(linearFrames[0].width(), linearFrames[0].height());
    judgement.moves = judgement.motion_px > mostMotion_px + mostMotionOfSmall_px2 / size;
    return judgement;
}

}  // namespace virga::shot
