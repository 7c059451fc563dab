// The entry points of the bundle: what Virga is to an OpenFX host, and the way from actions to instances.
#include <cstring>
#include <memory>

#include "Rain.h"
#include "abi/Ofx.h"

#define VIRGA_ENTRY extern "C" __attribute__((visibility("default")))

namespace virga::ofxplugin {
namespace {

using namespace ofx;

/// What the host keeps for an instance: the instance, or nothing yet.
Rain& rainOf(OfxImageEffectHandle effect)
{
    OfxPropertySetHandle set = nullptr;
    if (host().effect().getPropertySet(effect, &set) != statOk) throw Failure(statErrBadHandle, "no such effect");
    auto* rain = static_cast<Rain*>(Properties(set).pointer(prop::instanceData));
    if (rain == nullptr) throw Failure(statErrBadHandle, "an action came before the instance was created");
    return *rain;
}

void describe(OfxImageEffectHandle effect)
{
    OfxPropertySetHandle set = nullptr;
    if (host().effect().getPropertySet(effect, &set) != statOk) throw Failure(statErrBadHandle, "no such effect");
    const Properties plugin(set);
    plugin.set(prop::label, "Virga Rain");
    plugin.set(prop::shortLabel, "Rain");
    plugin.set(prop::longLabel, "Virga Rain");
    plugin.set(prop::grouping, "Virga");
    plugin.set(
        prop::description,
        "Rain into filmed footage: strokes by the physics of falling drops, lit by a panorama or by the plate "
        "itself, behind and before what the depth says, with fog, splashes and the grade of a rainy day. Frame n "
        "is the same whenever and wherever it is rendered.");
    plugin.set(prop::versionLabel, virga_version());
    plugin.set(prop::supportedContexts, value::contextFilter, 0);
    plugin.set(prop::supportedContexts, value::contextGeneral, 1);
    const char* const depths[] = {value::depthFloat, value::depthHalf, value::depthShort, value::depthByte};
    // A host that does not know half refuses it; the others then have to follow without a gap.
    int count = 0;
    for (const char* depth : depths)
        if (plugin.set(prop::supportedPixelDepths, depth, count)) ++count;
    plugin.set(prop::singleInstance, 0);
    plugin.set(prop::threadSafety, value::fullySafe);
    plugin.set(prop::hostFrameThreading, 0);  // one frame uses all cores, or the GPU
    plugin.set(prop::supportsMultiResolution, 1);
    plugin.set(prop::supportsTiles, 1);
    plugin.set(prop::temporalClipAccess, 1);  // for the light, from a few frames of the source
    plugin.set(prop::fieldRenderTwiceAlways, 0);
    plugin.set(prop::multipleClipDepths, 1);  // depth as float beside a plate of 8 bits
    plugin.set(prop::multipleClipPars, 0);
    // 1.5, where the host manages colour.
    const std::string style = Properties(host().properties()).text(prop::colourStyle);
    if (!style.empty() && style != value::colourNone) {
        plugin.set(prop::colourStyle, value::colourBasic);
        plugin.set(prop::colourConfigs, value::colourConfig);
    }
}

Properties defineClip(OfxImageEffectHandle effect, const char* name, std::initializer_list<const char*> components)
{
    OfxPropertySetHandle set = nullptr;
    if (host().effect().clipDefine(effect, name, &set) != statOk)
        throw Failure(statFailed, std::string("the host does not define the clip '") + name + "'");
    const Properties clip(set);
    int count = 0;
    for (const char* word : components)
        if (clip.set(prop::supportedComponents, word, count)) ++count;
    clip.set(prop::supportsTiles, 1);
    clip.set(prop::fieldExtraction, value::fieldBoth);
    return clip;
}

void describeInContext(OfxImageEffectHandle effect, const Properties& in)
{
    const auto picture = {value::componentRgba, value::componentRgb};
    const Properties source = defineClip(effect, value::clipSource, picture);
    source.set(prop::label, "Source");
    source.set(prop::temporalClipAccess, 1);
    defineClip(effect, value::clipOutput, picture);
    if (in.text(prop::context) == value::contextGeneral) {
        const Properties depth =
            defineClip(effect, "Depth", {value::componentAlpha, value::componentRgba, value::componentRgb});
        depth.set(prop::label, "Depth");
        depth.set(prop::optional, 1);
        const Properties environment = defineClip(effect, "Environment", picture);
        environment.set(prop::label, "Environment");
        environment.set(prop::optional, 1);
        environment.set(prop::supportsTiles, 0);
    }
    OfxParamSetHandle parameters = nullptr;
    if (host().effect().getParamSet(effect, &parameters) != statOk)
        throw Failure(statFailed, "the host gives no parameters to the effect");
    definePanel(parameters);
}

void createInstance(OfxImageEffectHandle effect)
{
    OfxPropertySetHandle set = nullptr;
    if (host().effect().getPropertySet(effect, &set) != statOk) throw Failure(statErrBadHandle, "no such effect");
    auto rain = std::make_unique<Rain>(effect);
    if (!Properties(set).set(prop::instanceData, static_cast<void*>(rain.get())))
        throw Failure(statErrMissingHostFeature, "the host keeps no data for an instance");
    rain.release();
}

void destroyInstance(OfxImageEffectHandle effect)
{
    OfxPropertySetHandle set = nullptr;
    if (host().effect().getPropertySet(effect, &set) != statOk) return;
    delete static_cast<Rain*>(Properties(set).pointer(prop::instanceData));
    Properties(set).set(prop::instanceData, static_cast<void*>(nullptr));
}

OfxStatus instanceChanged(Rain& rain, const Properties& in)
{
    if (in.text(prop::type) == value::typeClip) rain.forgetFrames();
    return statOk;
}

OfxStatus act(std::string_view name, OfxImageEffectHandle effect, const Properties& in, const Properties& out)
{
    if (name == action::load) return host().fetchSuites(), statOk;
    if (name == action::unload) return statOk;
    if (name == action::describe) return describe(effect), statOk;
    if (name == action::describeInContext) return describeInContext(effect, in), statOk;
    if (name == action::createInstance) return createInstance(effect), statOk;
    if (name == action::destroyInstance) return destroyInstance(effect), statOk;
    if (name == action::instanceChanged) return instanceChanged(rainOf(effect), in);
    if (name == action::purgeCaches) return rainOf(effect).purge(), statOk;
    if (name == action::beginSequenceRender) return rainOf(effect).forgetFrames(), statOk;
    if (name == action::getRegionOfDefinition) return rainOf(effect).regionOfDefinition(in, out);
    try {
        if (name == action::isIdentity) return rainOf(effect).isIdentity(in, out);
        if (name == action::getRegionsOfInterest) return rainOf(effect).regionsOfInterest(in, out);
        if (name == action::getFramesNeeded) return rainOf(effect).framesNeeded(in, out);
    } catch (const Failure&) {
        return statReplyDefault;  // the render, which comes next, fails for the same reason and says why
    }
    if (name == action::getClipPreferences) return rainOf(effect).clipPreferences(out);
    if (name == action::getOutputColourspace) {
        out.set(prop::clipColourspace, value::colourOfSource);
        return statOk;
    }
    if (name == action::render) {
        const OfxStatus status = rainOf(effect).render(in);
        host().clearError(effect);
        return status;
    }
    return statReplyDefault;
}

OfxStatus mainEntry(const char* name, const void* handle, OfxPropertySetHandle in, OfxPropertySetHandle out) noexcept
{
    auto* const effect = static_cast<OfxImageEffectHandle>(const_cast<void*>(handle));
    const bool isInstance = name != nullptr && std::strcmp(name, action::load) != 0;
    try {
        if (name == nullptr) return statErrValue;
        return act(name, effect, Properties(in), Properties(out));
    } catch (const Failure& failure) {
        host().showError(isInstance ? effect : nullptr, failure.what());
        return failure.status;
    } catch (const std::bad_alloc&) {
        host().showError(isInstance ? effect : nullptr, "out of memory");
        return statErrMemory;
    } catch (const std::exception& error) {
        host().showError(isInstance ? effect : nullptr, error.what());
        return statFailed;
    } catch (...) {
        return statFailed;
    }
}

OfxStatus entry(const char* name, const void* handle, OfxPropertySetHandle in, OfxPropertySetHandle out)
{
    return mainEntry(name, handle, in, out);
}

void setHost(OfxHost* given) { host().meet(given); }

}  // namespace
}  // namespace virga::ofxplugin

VIRGA_ENTRY int OfxGetNumberOfPlugins(void) { return 1; }

VIRGA_ENTRY OfxPlugin* OfxGetPlugin(int index)
{
    using namespace virga::ofxplugin;
    // The major version counts what breaks saved projects: names and meanings of parameters.
    static OfxPlugin rain{ofx::imageEffectApi, 1, "org.virga.rain", 1, 0, setHost, entry};
    return index == 0 ? &rain : nullptr;
}
