#include "matte/FrameAlignment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <optional>
#include <utility>

#include "core/Error.h"
#include "core/Parallel.h"
#include "matte/FrameFeatures.h"
#include "matte/FrameNeighbourhood.h"
#include "matte/FramePlacement.h"
#include "matte/FramePyramid.h"
#include "matte/PlaneTransform.h"

namespace virga::matte {
namespace {

using namespace alignment;

constexpr int smallestSide = 16;               // of a picture that is looked at [px]
constexpr int featureSide = 500;               // features are looked for in the first level whose sides are no longer
constexpr double matchTolerance_px = 1.5;      // in the picture that features are found in
constexpr int fewestInliers = 4;               // cells
constexpr std::size_t fewestMedianFrames = 5;  // of fewer it is no better than a frame

/// All that is known while frames are aligned. Frames are by number; transforms are frame from reference, normalised.
class Alignment {
public:
    Alignment(std::span<const ImageF> frames, std::size_t reference, const AlignmentOptions& options,
              const BrightnessRange& range);

    void chain();          ///< each frame to its neighbour on the side of the reference, roughly
    void chooseAnchors();  ///< what each is refined against
    void refine();         ///< on the pixels of the frames, against their anchors
    void polish();         ///< once more, against pictures that have no rain of their own
    std::vector<FrameAlignment> result() const;

private:
    bool isGood(const std::optional<Placement>& p) const
    {
        return p && p->judgement.inliers >= fewestInliers && p->judgement.share >= options_.minInlierShare;
    }
    std::size_t inwards(std::size_t k) const { return k > reference_ ? k - 1 : k + 1; }
    ImageF base(std::size_t k) const { return smoothedBrightness(frames_[k], range_); }
    Pyramid whole(std::size_t k) const
    {
        Pyramid pyramid = pyramids_[k];
        if (pyramid[0].empty()) pyramid[0] = base(k);
        return pyramid;
    }
    /// The body for each of some frames, on all cores.
    static void each(std::span<const std::size_t> which, const std::function<void(std::size_t)>& body)
    {
        parallelFor(0, std::ptrdiff_t(which.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (std::ptrdiff_t i = first; i < last; ++i) body(which[std::size_t(i)]);
        });
    }

    std::optional<Placement> link(const Template& from, std::size_t a, std::size_t b) const;
    void refine(std::size_t k, const Template& anchor);
    void refineElsewhere(std::size_t k);
    void polish(std::size_t anchor, std::span<const std::optional<PlaneTransform>> before);

    std::span<const ImageF> frames_;
    std::size_t reference_;
    AlignmentOptions options_;
    BrightnessRange range_;
    Grid grid_;
    int featureLevel_ = 0, top_ = 0, lowest_ = 0;  // levels: of the features, the smallest, the largest that is kept
    std::vector<std::size_t> outwards_;  // all but the reference; those nearer to it on the same side come before
    std::vector<Pyramid> pyramids_;
    std::vector<Features> features_;
    std::vector<std::optional<PlaneTransform>> chained_, placed_;  // roughly, and exactly
    std::vector<std::size_t> anchors_;
    std::vector<Judgement> judgements_;  // against the anchors
};

Alignment::Alignment(std::span<const ImageF> frames, std::size_t reference, const AlignmentOptions& options,
                     const BrightnessRange& range)
    : frames_(frames), reference_(reference), options_(options), range_(range),
      grid_(frames[0].width(), frames[0].height()), pyramids_(frames.size()), features_(frames.size()),
      chained_(frames.size()), placed_(frames.size()), anchors_(frames.size(), reference), judgements_(frames.size())
{
    for (std::size_t k = reference + 1; k < frames.size(); ++k) outwards_.push_back(k);
    for (std::size_t k = reference; k-- > 0;) outwards_.push_back(k);
    chained_[reference] = placed_[reference] = PlaneTransform{};
    judgements_[reference].share = 1;

    int side = std::min(frames[0].width(), frames[0].height());
    for (; side >= 2 * topSide; side = (side + 1) / 2) ++top_;
    lowest_ = std::min(1, top_);
    while (featureLevel_ < top_ && std::max(frames[0].width(), frames[0].height()) >> featureLevel_ > featureSide)
        ++featureLevel_;
    std::vector<std::size_t> all = outwards_;
    all.push_back(reference);
    each(all, [&](std::size_t k) {
        Pyramid pyramid = pyramidOf(frames_[k], range_);
        features_[k] = featuresOf(pyramid[std::size_t(featureLevel_)], grid_, featureLevel_, options_.mostFeatures);
        if (lowest_ > 0) pyramid[0] = {};
        pyramids_[k] = std::move(pyramid);
    });
}

/// From a to b by features, and if they fail from where nothing has moved.
std::optional<Placement> Alignment::link(const Template& from, std::size_t a, std::size_t b) const
{
    const double tolerance = matchTolerance_px / grid_.pixelScale(featureLevel_);
    std::optional<Placement> placed;
    if (const auto guess = roughTransform(features_[a], features_[b], tolerance))
        placed = place(from, pyramids_[b], grid_, *guess, std::min(top_, 2), lowest_);
    if (isGood(placed)) return placed;
    const auto still = place(from, pyramids_[b], grid_, PlaneTransform{}, top_, lowest_);
    return still && (!placed || still->judgement.share > placed->judgement.share) ? still : placed;
}

void Alignment::chain()
{
    std::vector<std::optional<Placement>> links(frames_.size());
    each(outwards_,
         [&](std::size_t k) { links[k] = link(templateOf(pyramids_[inwards(k)], grid_, lowest_), inwards(k), k); });
    for (const std::size_t k : outwards_) {
        std::size_t nearest = inwards(k);
        if (isGood(links[k]) && chained_[nearest]) {
            chained_[k] = links[k]->fit.frame * *chained_[nearest];
            continue;
        }
        // Past a frame that was lost: the nearest that was not, and the reference itself.
        while (!chained_[nearest]) nearest = inwards(nearest);
        for (const std::size_t a : {nearest, reference_}) {
            const auto past = link(templateOf(pyramids_[a], grid_, lowest_), a, k);
            if (!isGood(past)) continue;
            chained_[k] = past->fit.frame * *chained_[a];
            break;
        }
    }
}

void Alignment::chooseAnchors()
{
    for (const bool after : {true, false}) {
        std::size_t anchor = reference_, previous = reference_;
        for (const std::size_t k : outwards_) {
            if ((k > reference_) != after || !chained_[k]) continue;
            if (overlapOf(*chained_[k] * chained_[anchor]->inverse(), grid_) < options_.minOverlap) anchor = previous;
            anchors_[k] = anchor;
            previous = k;
        }
    }
}

void Alignment::refine(std::size_t k, const Template& anchor)
{
    const std::size_t a = anchors_[k];
    const auto p = place(anchor, whole(k), grid_, *chained_[k] * chained_[a]->inverse(), std::min(top_, 2), 0);
    if (!isGood(p)) return;
    placed_[k] = p->fit.frame * *placed_[a];
    judgements_[k] = p->judgement;
}

/// A frame that its anchor does not recognise, against the nearest that has its place.
void Alignment::refineElsewhere(std::size_t k)
{
    std::size_t nearest = inwards(k);
    while (!placed_[nearest]) nearest = inwards(nearest);
    if (nearest == anchors_[k]) return;
    anchors_[k] = nearest;
    refine(k, templateOf(whole(nearest), grid_, 0));
}

void Alignment::refine()
{
    // Anchors first, as they are needed; each has its own before it.
    std::vector<std::optional<Template>> templates(frames_.size());
    templates[reference_] = templateOf(whole(reference_), grid_, 0);
    std::vector<std::size_t> rest;
    const std::vector<std::size_t> anchors = anchors_;
    for (const std::size_t k : outwards_) {
        if (!chained_[k]) continue;
        if (std::find(anchors.begin(), anchors.end(), k) == anchors.end()) {
            rest.push_back(k);
            continue;
        }
        if (templates[anchors_[k]]) refine(k, *templates[anchors_[k]]);
        if (!placed_[k]) refineElsewhere(k);
        if (placed_[k]) templates[k] = templateOf(whole(k), grid_, 0);
    }
    each(rest, [&](std::size_t k) {
        if (templates[anchors_[k]]) refine(k, *templates[anchors_[k]]);
    });
    for (const std::size_t k : rest)
        if (!placed_[k]) refineElsewhere(k);
}

void Alignment::polish()
{
    const std::vector<std::optional<PlaneTransform>> before = placed_;
    polish(reference_, before);
    for (const std::size_t anchor : outwards_) polish(anchor, before);
}

/// The frames of one anchor, whose own place is known by now.
void Alignment::polish(std::size_t anchor, std::span<const std::optional<PlaneTransform>> before)
{
    std::vector<std::size_t> members;
    for (const std::size_t k : outwards_)
        if (anchors_[k] == anchor && before[k]) members.push_back(k);
    if (members.empty()) return;
    const PlaneTransform referenceFromAnchor = before[anchor]->inverse();
    for (const std::size_t k : members) placed_[k] = *before[k] * referenceFromAnchor * *placed_[anchor];
    const FrameNeighbourhood near(anchor, before, grid_, [this](std::size_t k) { return base(k); });
    if (near.size() < fewestMedianFrames) return;
    const Template common = templateOf({near.medianWithout(frames_.size())}, grid_, 0);
    const auto placedAgain = [&](std::size_t k, const PlaneTransform& guess) {
        const Pyramid picture = {base(k)};
        if (!near.contains(k)) return place(common, picture, grid_, guess, 0, 0);
        return place(templateOf({near.medianWithout(k)}, grid_, 0), picture, grid_, guess, 0, 0);
    };
    // The median lies where its frames do on average, which is not quite where the anchor does.
    const auto own = placedAgain(anchor, PlaneTransform{});
    if (!isGood(own)) return;
    const PlaneTransform medianFromReference = own->fit.frame.inverse() * *placed_[anchor];
    each(members, [&](std::size_t k) {
        const auto p = placedAgain(k, *before[k] * referenceFromAnchor);
        if (!isGood(p)) return;
        placed_[k] = p->fit.frame * medianFromReference;
        judgements_[k] = p->judgement;
    });
}

Homography pixelHomography(const PlaneTransform& frame, const Grid& grid)
{
    // Normalised -> pixels whose centres are at + 1/2.
    PlaneTransform pixels = grid.pixels(0);
    pixels.m[2] += 0.5;
    pixels.m[5] += 0.5;
    const PlaneTransform referenceFromFrame = pixels * frame.inverse() * pixels.inverse();
    return {referenceFromFrame.dividedBy(referenceFromFrame.m[8]).m};
}

std::vector<FrameAlignment> Alignment::result() const
{
    std::vector<FrameAlignment> result(frames_.size());
    result[reference_] = {{}, true, 0, 1, 0};
    const double width = frames_[0].width(), height = frames_[0].height();
    for (const std::size_t k : outwards_) {
        if (!placed_[k]) continue;
        const Homography h = pixelHomography(*placed_[k], grid_);
        if (!std::all_of(h.m.begin(), h.m.end(), [](double v) { return std::isfinite(v); })) continue;
        // A frame is no better placed than what it was placed against.
        const FrameAlignment& anchor = result[anchors_[k]];
        FrameAlignment& out = result[k];
        out = {h, true, std::hypot(judgements_[k].residual_px, anchor.residual_px),
               std::min(judgements_[k].share, anchor.inlierShare), 0};
        for (const auto& [x, y] : {std::array{0.0, 0.0}, {width, 0.0}, {0.0, height}, {width, height}}) {
            const auto at = h(x, y);
            out.motion_px = std::max(out.motion_px, std::hypot(at[0] - x, at[1] - y));
        }
    }
    return result;
}

void check(std::span<const ImageF> frames, int reference, const AlignmentOptions& options)
{
    if (reference < 0 || std::size_t(reference) >= frames.size())
        throw Error(ErrorCode::Internal, "reference frame {}: must be one of the {} frames", reference, frames.size());
    const ImageF& first = frames[0];
    if (first.channels() != 1 && first.channels() != 3)
        throw Error(ErrorCode::Internal, "frames of {} channels: must be 1 or 3", first.channels());
    for (const ImageF& frame : frames) {
        if (frame.width() == first.width() && frame.height() == first.height() && frame.channels() == first.channels())
            continue;
        throw Error(ErrorCode::Internal, "a frame of {} x {} x {}: must be {} x {} x {} like the first", frame.width(),
                    frame.height(), frame.channels(), first.width(), first.height(), first.channels());
    }
    if (options.mostFeatures < int(fewestMatches))
        throw Error(ErrorCode::Internal, "mostFeatures {}: must be at least {}", options.mostFeatures, fewestMatches);
    if (options.polishes < 0) throw Error(ErrorCode::Internal, "polishes {}: must not be negative", options.polishes);
    if (!(options.minOverlap >= 0 && options.minOverlap <= 1))
        throw Error(ErrorCode::Internal, "minOverlap {}: must be 0 to 1", options.minOverlap);
    if (!(options.minInlierShare >= 0 && options.minInlierShare <= 1))
        throw Error(ErrorCode::Internal, "minInlierShare {}: must be 0 to 1", options.minInlierShare);
}

}  // namespace

std::vector<FrameAlignment> alignFrames(std::span<const ImageF> frames, int reference, const AlignmentOptions& options)
{
    check(frames, reference, options);
    const BrightnessRange range = rangeOf(frames[std::size_t(reference)]);
    if (std::min(frames[0].width(), frames[0].height()) < smallestSide || range.empty()) {
        std::vector<FrameAlignment> nothing(frames.size());
        nothing[std::size_t(reference)] = {{}, true, 0, 1, 0};
        return nothing;
    }
    Alignment alignment(frames, std::size_t(reference), options, range);
    alignment.chain();
    alignment.chooseAnchors();
    alignment.refine();
    for (int round = 0; round < options.polishes; ++round) alignment.polish();
    return alignment.result();
}

}  // namespace virga::matte
