#include "Rain.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace virga::ofxplugin {

using namespace std::chrono_literals;

namespace {

/// Regions this large are the standard's word for "everywhere".
bool isInfinite(const OfxRectD& r) { return r.x1 < -1e6 || r.y1 < -1e6 || r.x2 > 1e6 || r.y2 > 1e6; }

const std::string& textOf(const char* row, const std::vector<std::string>& texts)
{
    const auto rows = panel();
    const auto at = std::find_if(rows.begin(), rows.end(), [&](const PanelRow& r) { return r.name == row; });
    return texts.at(std::size_t(at - rows.begin()));
}

}  // namespace

double frameAt(OfxTime time)
{
    const double whole = std::round(time);
    return std::abs(time - whole) < 1e-6 ? whole : time;
}

double scaleOf(const Properties& in)
{
    const auto scales = in.numbers<2>(ofx::prop::renderScale).value_or(std::array{1.0, 1.0});
    if (std::abs(scales[0] - scales[1]) > 1e-6 * scales[0] || !(scales[0] > 0 && scales[0] <= 1))
        throw Failure(ofx::statErrUnsupported, "a render scale of " + std::to_string(scales[0]) + " x " +
                                                   std::to_string(scales[1]) +
                                                   ": must be the same both ways, over 0 to 1");
    return scales[0];
}

OfxRectD Rain::Place::canonical(const virga_window& window) const
{
    const OfxRectI p = frame.planeOf(window);
    return {p.x1 * aspect / scale, p.y1 / scale, p.x2 * aspect / scale, p.y2 / scale};
}

OfxRectI Rain::Place::plane(const OfxRectD& r) const
{
    const auto down = [](double v) { return int(std::floor(v + 1e-6)); };
    const auto up = [](double v) { return int(std::ceil(v - 1e-6)); };
    return {down(r.x1 * scale / aspect), down(r.y1 * scale), up(r.x2 * scale / aspect), up(r.y2 * scale)};
}

Rain::Rain(OfxImageEffectHandle effect)
    : effect_(effect), properties_([&] {
          OfxPropertySetHandle set = nullptr;
          host().effect().getPropertySet(effect, &set);
          return set;
      }()),
      values_([&] {
          OfxParamSetHandle set = nullptr;
          if (host().effect().getParamSet(effect, &set) != ofx::statOk)
              throw Failure(ofx::statFailed, "the host has lost the effect's parameters");
          return set;
      }()),
      source_(effect, ofx::value::clipSource), output_(effect, ofx::value::clipOutput)
{
    // Clips of the general context alone.
    OfxImageClipHandle clip = nullptr;
    if (properties_.text(ofx::prop::context) != ofx::value::contextGeneral) return;
    if (host().effect().clipGetHandle(effect, "Depth", &clip, nullptr) == ofx::statOk) depth_.emplace(effect, "Depth");
    if (host().effect().clipGetHandle(effect, "Environment", &clip, nullptr) == ofx::statOk)
        environment_.emplace(effect, "Environment");
}

Rain::Place Rain::placeOf(OfxTime time, double scale) const
{
    Place place;
    place.scale = scale;
    place.aspect = source_.properties().number(ofx::prop::pixelAspect, 1);
    if (!(place.aspect > 0)) place.aspect = 1;
    place.fps = source_.properties().number(ofx::prop::frameRate, 0);
    if (!(place.fps > 0)) place.fps = properties_.number(ofx::prop::frameRate, 0);
    if (!(place.fps > 0)) place.fps = 24;  // a still in a host without a project

    OfxRectD region = source_.regionOfDefinition(time).value_or(OfxRectD{-1e9, -1e9, 1e9, 1e9});
    if (isInfinite(region) || values_.choice(control::frame, time) == control::ofProject) {
        const auto size = properties_.numbers<2>(ofx::prop::projectSize);
        const auto offset = properties_.numbers<2>(ofx::prop::projectOffset).value_or(std::array{0.0, 0.0});
        if (!size || !((*size)[0] > 0 && (*size)[1] > 0))
            throw Failure(ofx::statFailed, "the source has no size, and the host does not say the project's");
        region = {offset[0], offset[1], offset[0] + (*size)[0], offset[1] + (*size)[1]};
    }
    const auto pixels = [](double length) { return std::max(int(std::lround(length)), 1); };
    place.width = pixels((region.x2 - region.x1) / place.aspect);
    place.height = pixels(region.y2 - region.y1);
    place.frame = {int(std::lround(region.x1 * scale / place.aspect)), int(std::lround(region.y1 * scale)),
                   pixels(place.width * scale), pixels(place.height * scale)};
    return place;
}

void Rain::withShot(const Place& place, const std::vector<std::string>& texts, const std::function<void(SetShot&)>& use)
{
    std::unique_lock turn(turn_, std::defer_lock);
    while (!turn.try_lock_for(10ms))
        if (host().effect().abort(effect_) != 0) throw Abandoned();
    if (!shot_ || !shot_->is(place.width, place.height, place.fps)) {
        shot_.reset();
        shot_.emplace(place.width, place.height, place.fps);
    }
    shot_->set(texts);
    use(*shot_);
}

void Rain::purge()
{
    const std::scoped_lock turns(turn_, askTurn_);
    shot_.reset();
    asked_.reset();
}

OfxStatus Rain::isIdentity(const Properties& in, const Properties& out)
{
    const OfxTime time = in.number(ofx::prop::time, 0);
    if (values_.choice(control::output, time) != control::beauty) return ofx::statReplyDefault;
    int isIdentity = 0;
    {
        const std::lock_guard turn(askTurn_);
        if (!asked_) asked_.emplace(16, 16, 24);
        asked_->set(values_.texts(time));
        needs(virga_shot_is_identity(asked_->get(), &isIdentity));
    }
    if (isIdentity == 0) return ofx::statReplyDefault;
    out.set(ofx::prop::name, ofx::value::clipSource);
    out.set(ofx::prop::time, time);
    return ofx::statOk;
}

OfxStatus Rain::regionOfDefinition(const Properties& in, const Properties& out) const
{
    const auto region = source_.regionOfDefinition(in.number(ofx::prop::time, 0));
    if (!region) return ofx::statReplyDefault;
    out.set(ofx::prop::regionOfDefinition, std::array{region->x1, region->y1, region->x2, region->y2});
    return ofx::statOk;
}

OfxStatus Rain::regionsOfInterest(const Properties& in, const Properties& out)
{
    const OfxTime time = in.number(ofx::prop::time, 0);
    const auto wanted = in.numbers<4>(ofx::prop::regionOfInterest);
    if (!wanted) return ofx::statReplyDefault;
    const double scale = scaleOf(in);
    const auto set = [&](const char* clip, const OfxRectD& r) {
        out.set((std::string(ofx::prop::clipRegionOfInterest) + clip).c_str(), std::array{r.x1, r.y1, r.x2, r.y2});
    };
    for (const auto& [clip, name] : {std::pair(&depth_, "Depth"), std::pair(&environment_, "Environment")})
        if (isConnected(*clip))
            if (const auto whole = (*clip)->regionOfDefinition(time)) set(name, *whole);

    const Place place = placeOf(time, scale);
    const OfxRectD region{(*wanted)[0], (*wanted)[1], (*wanted)[2], (*wanted)[3]};
    OfxRectD needed = place.canonical(place.whole());
    // What a frame needs is known once the shot has been set up; while another thread has it, all will do.
    std::unique_lock turn(turn_, std::defer_lock);
    if (turn.try_lock() && shot_ && shot_->is(place.width, place.height, place.fps)) {
        shot_->set(values_.texts(time));
        virga_request request = virga_request_default();
        request.frame = frameAt(time);
        request.scale = scale;
        request.region = place.frame.windowOf(place.plane(region));
        virga_window window{};
        if (request.region.width > 0 && virga_shot_plate_needed(shot_->get(), &request, &window) == VIRGA_OK)
            needed = place.canonical(window);
    }
    set(ofx::value::clipSource, {std::min(region.x1, needed.x1), std::min(region.y1, needed.y1),
                                 std::max(region.x2, needed.x2), std::max(region.y2, needed.y2)});
    return ofx::statOk;
}

std::vector<std::int64_t> Rain::samplesWanted(const std::vector<std::string>& texts)
{
    if (Properties(host().properties()).whole(ofx::prop::temporalClipAccess, 0) == 0) return {};
    if (isConnected(environment_) && textOf("grade_from", texts).empty()) return {};
    const auto range = source_.properties().numbers<2>(ofx::prop::frameRange);
    if (!range || !((*range)[1] >= (*range)[0]) || (*range)[1] - (*range)[0] > 1e6) return {};
    const std::lock_guard turn(askTurn_);
    if (!asked_) asked_.emplace(16, 16, 24);
    asked_->set(texts);
    std::vector<std::int64_t> frames(64);
    std::size_t count = 0;
    needs(virga_shot_samples_wanted(asked_->get(), std::int64_t(std::ceil((*range)[0])),
                                    std::int64_t(std::floor((*range)[1])), frames.data(), frames.size(), &count));
    frames.resize(std::min(count, frames.size()));
    return frames;
}

OfxStatus Rain::framesNeeded(const Properties& in, const Properties& out)
{
    const OfxTime time = in.number(ofx::prop::time, 0);
    std::vector<double> ranges{time, time};
    for (const std::int64_t frame : samplesWanted(values_.texts(time))) ranges.insert(ranges.end(), 2, double(frame));
    if (ranges.size() == 2) return ofx::statReplyDefault;
    const std::string name = std::string(ofx::prop::clipFrameRange) + ofx::value::clipSource;
    host().property().propSetDoubleN(out.handle(), name.c_str(), int(ranges.size()), ranges.data());
    return ofx::statOk;
}

OfxStatus Rain::clipPreferences(const Properties& out) const
{
    out.set(ofx::prop::frameVarying, 1);
    const Properties hosts(host().properties());
    if (depth_ && hosts.whole(ofx::prop::multipleClipDepths, 0) != 0)
        out.set((std::string(ofx::prop::clipDepth) + "Depth").c_str(), ofx::value::depthFloat);
    const std::string style = hosts.text(ofx::prop::colourStyle);
    if (!style.empty() && style != ofx::value::colourNone) {
        const std::string preferred = ofx::prop::clipPreferredColourspaces;
        out.set((preferred + ofx::value::clipSource).c_str(), ofx::value::sceneLinear);
        if (environment_) out.set((preferred + "Environment").c_str(), ofx::value::colourOfSource);
    }
    return ofx::statOk;
}

void Rain::giveColour(virga_picture& picture, const Clip& clip, OfxTime time, std::string& name) const
{
    name.clear();
    switch (values_.choice(control::pixels, time)) {
        case control::linear: break;
        case control::video: name = "sRGB"; break;
        case control::named: name = values_.text(control::colourSpace, time); break;
        default: {
            const std::string told = clip.properties().text(ofx::prop::clipColourspace);
            if (told == ofx::value::sceneLinear)
                name.clear();
            else if (told.empty() || told.starts_with("OfxColourspace_") || told.starts_with("ofx_"))
                name = picture.samples == VIRGA_FLOAT || picture.samples == VIRGA_HALF ? "" : "sRGB";
            else
                name = told;
        }
    }
    picture.color_space = name.empty() ? nullptr : name.c_str();
}

}  // namespace virga::ofxplugin
