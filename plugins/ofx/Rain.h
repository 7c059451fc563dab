// One effect on a node or a clip: what the host asks of an instance, answered by shots of libvirga.
//
// Threads: hosts may render, ask for regions and ask for identity on any threads at once (fully safe). Renders of one
// instance take turns, as one shot has one set of values at a time; while one waits or renders it asks the host, on the
// host's own thread, whether the frame is still wanted. No image is fetched while others wait for the shot: fetching
// renders what is upstream. Identity and frames needed are answered from a shot of their own that never renders.
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "Images.h"
#include "Panel.h"
#include "SetShot.h"

namespace virga::ofxplugin {

/// OpenFX's time counts frames; a fraction (a retimed clip) is between two. What sums of steps are off by is not one.
double frameAt(OfxTime time);
/// The scale of a render. Throws Failure unless it is the same both ways and within (0, 1].
double scaleOf(const Properties& in);

class Rain {
public:
    /// Throws Failure if the host has lost a parameter or clip that was defined.
    explicit Rain(OfxImageEffectHandle effect);

    // The actions. They throw Failure.
    OfxStatus isIdentity(const Properties& in, const Properties& out);
    OfxStatus regionOfDefinition(const Properties& in, const Properties& out) const;
    OfxStatus regionsOfInterest(const Properties& in, const Properties& out);
    OfxStatus framesNeeded(const Properties& in, const Properties& out);
    OfxStatus clipPreferences(const Properties& out) const;
    OfxStatus render(const Properties& in);
    /// Frames that come in may be others than before under the same numbers.
    void forgetFrames() { framesMayDiffer_ = true; }
    /// Gives up all that can be made anew.
    void purge();

private:
    /// Where the frame lies and what it is, at a time and a scale.
    struct Place {
        int width = 0, height = 0;  // at scale 1
        double fps = 24, scale = 1, aspect = 1;
        FrameInPlane frame;  // at the scale

        OfxRectD canonical(const virga_window& window) const;
        OfxRectI plane(const OfxRectD& canonical) const;
        virga_window whole() const { return {0, 0, frame.width, frame.height}; }
    };
    struct Work;  // of one render
    class Abandoned {};

    Place placeOf(OfxTime time, double scale) const;
    bool isConnected(const std::optional<Clip>& clip) const { return clip && clip->isConnected(); }
    /// Calls `use` with the shot, set to the values, while nobody else has it. Throws Abandoned if the host gives up
    /// the frame meanwhile.
    void withShot(const Place& place, const std::vector<std::string>& texts, const std::function<void(SetShot&)>& use);
    /// Frames of the source that had better stand for all of it; none if the host gives one frame alone.
    std::vector<std::int64_t> samplesWanted(const std::vector<std::string>& texts);
    void fetchSamples(Work& work) const;
    void fetchEnvironment(Work& work) const;
    void giveSamples(SetShot& shot, const Work& work) const;
    void giveEnvironment(SetShot& shot, const Work& work) const;
    void renderInto(Work& work);
    /// Says what the picture's numbers mean, as the panel or the host has it; `name` must outlive the picture.
    void giveColour(virga_picture& picture, const Clip& clip, OfxTime time, std::string& name) const;

    OfxImageEffectHandle effect_;
    Properties properties_;
    PanelValues values_;
    Clip source_, output_;
    std::optional<Clip> depth_, environment_;
    std::atomic<bool> framesMayDiffer_ = true;

    std::timed_mutex turn_;  // of shot_
    std::optional<SetShot> shot_;
    std::mutex askTurn_;  // of asked_
    std::optional<SetShot> asked_;
};

}  // namespace virga::ofxplugin
