#include "OfxHost.h"

#include <dlfcn.h>

#include <cstdarg>
#include <cstdio>

#include "OfxHostInside.h"

namespace virga::test {

using namespace inside;

namespace {

PropertySet* setOf(OfxPropertySetHandle handle, const char* property, char type)
{
    if (acting == nullptr && action.empty()) misuse("a property suite call from a thread without an action");
    if (handle == nullptr || !isLiving(handle)) {
        misuse(std::string("a property of a handle that does not live: ") + (property != nullptr ? property : "?"));
        return nullptr;
    }
    auto* set = reinterpret_cast<PropertySet*>(handle);
    const char known = typeOf(*set, property);
    if (known == 0)
        misuse("the standard gives no " + std::string(property) + " to " + set->kind);
    else if (type != 0 && known != type)
        misuse(std::string(property) + " of " + set->kind + " is of another type");
    else
        return set;
    return nullptr;
}

template <class T>
OfxStatus put(OfxPropertySetHandle handle, const char* property, int index, T value, char type)
{
    PropertySet* set = setOf(handle, property, type);
    if (set == nullptr) return ofx::statErrUnknown;
    auto& values = set->properties[property].values;
    if (index < 0 || index > int(values.size())) {
        misuse(std::string(property) + ": index " + std::to_string(index) + " leaves a gap");
        return ofx::statErrBadIndex;
    }
    if (index == int(values.size()))
        values.emplace_back(value);
    else
        values[std::size_t(index)] = value;
    return ofx::statOk;
}

template <class T, class U>
OfxStatus take(OfxPropertySetHandle handle, const char* property, int index, U* value, char type)
{
    PropertySet* set = setOf(handle, property, type);
    if (set == nullptr) return ofx::statErrUnknown;
    const auto at = set->properties.find(property);
    if (at == set->properties.end()) return ofx::statErrUnknown;
    if (index < 0 || index >= int(at->second.values.size())) return ofx::statErrBadIndex;
    auto& held = at->second.values[std::size_t(index)];
    if constexpr (std::is_same_v<T, std::string>)
        *value = std::get<std::string>(held).data();
    else
        *value = std::get<T>(held);
    return ofx::statOk;
}

}  // namespace

/// The functions of the suites.
struct Suites {
    static HostEffect* effectOf(OfxImageEffectHandle handle, const char* call)
    {
        if (acting == nullptr) misuse(std::string(call) + " from a thread without an action");
        if (handle != nullptr && isLiving(handle)) return reinterpret_cast<HostEffect*>(handle);
        misuse(std::string(call) + " with an effect that does not live");
        return nullptr;
    }
    static HostClip* clipOf(OfxImageClipHandle handle, const char* call)
    {
        if (acting == nullptr) misuse(std::string(call) + " from a thread without an action");
        if (handle != nullptr && isLiving(handle)) return reinterpret_cast<HostClip*>(handle);
        misuse(std::string(call) + " with a clip that does not live");
        return nullptr;
    }
    static OfxStatus getPropertySet(OfxImageEffectHandle handle, OfxPropertySetHandle* set)
    {
        HostEffect* effect = effectOf(handle, "getPropertySet");
        if (effect == nullptr) return ofx::statErrBadHandle;
        *set = effect->isInstance_ ? effect->instance_.handle() : effect->description_.handle();
        return ofx::statOk;
    }
    static OfxStatus getParamSet(OfxImageEffectHandle handle, OfxParamSetHandle* set)
    {
        if (effectOf(handle, "getParamSet") == nullptr) return ofx::statErrBadHandle;
        *set = reinterpret_cast<OfxParamSetHandle>(handle);
        return ofx::statOk;
    }
    static OfxStatus clipDefine(OfxImageEffectHandle handle, const char* name, OfxPropertySetHandle* set)
    {
        HostEffect* effect = effectOf(handle, "clipDefine");
        if (effect == nullptr) return ofx::statErrBadHandle;
        if (action != ofx::action::describeInContext) misuse("clipDefine outside of describing");
        if (effect->clips_.contains(name)) misuse(std::string("clip defined twice: ") + name);
        auto& clip = effect->clips_[name] = std::make_unique<HostClip>();
        clip->name = name;
        clip->properties = std::make_unique<PropertySet>("clip descriptor");
        bear(clip.get());
        *set = clip->properties->handle();
        return ofx::statOk;
    }
    static OfxStatus clipGetHandle(OfxImageEffectHandle handle, const char* name, OfxImageClipHandle* clip,
                                   OfxPropertySetHandle* set)
    {
        HostEffect* effect = effectOf(handle, "clipGetHandle");
        if (effect == nullptr) return ofx::statErrBadHandle;
        if (!effect->isInstance_) misuse("clipGetHandle of a description");
        if (!effect->clips_.contains(name)) return ofx::statErrUnknown;
        *clip = reinterpret_cast<OfxImageClipHandle>(effect->clips_[name].get());
        if (set != nullptr) *set = effect->clips_[name]->properties->handle();
        return ofx::statOk;
    }
    static OfxStatus clipGetPropertySet(OfxImageClipHandle handle, OfxPropertySetHandle* set)
    {
        HostClip* clip = clipOf(handle, "clipGetPropertySet");
        if (clip == nullptr) return ofx::statErrBadHandle;
        *set = clip->properties->handle();
        return ofx::statOk;
    }
    static OfxStatus clipGetImage(OfxImageClipHandle handle, OfxTime time, const OfxRectD* region,
                                  OfxPropertySetHandle* image)
    {
        HostClip* clip = clipOf(handle, "clipGetImage");
        if (clip == nullptr) return ofx::statErrBadHandle;
        if (action != ofx::action::render) misuse("clipGetImage outside of rendering");
        {
            const std::lock_guard lock(mutexOfHost());
            clip->asked.push_back(time);
        }
        if (clip->hasGone || !clip->isConnected) return ofx::statFailed;
        auto made = std::make_unique<HostImage>();
        if (clip->name == ofx::value::clipOutput) {
            made->lay(*clip, state.window);
            *image = made->set.handle();
            state.output = std::move(made);
            return ofx::statOk;
        }
        if (time != state.time && !acting->host_.kind().temporalAccess)
            misuse("another time's image from a host without temporal access");
        acting->layImage(*made, *clip, time, region);
        *image = made->set.handle();
        state.images.push_back(std::move(made));
        return ofx::statOk;
    }
    static OfxStatus clipReleaseImage(OfxPropertySetHandle image)
    {
        if (acting == nullptr) return misuse("clipReleaseImage from a thread without an action"), ofx::statErrBadHandle;
        if (!isLiving(image)) return misuse("an image released that does not live"), ofx::statErrBadHandle;
        if (state.output && state.output->set.handle() == image) {
            state.outputIsReleased = true;
            return ofx::statOk;
        }
        std::erase_if(state.images, [&](const auto& one) { return one->set.handle() == image; });
        return ofx::statOk;
    }
    static OfxStatus clipGetRegion(OfxImageClipHandle handle, OfxTime, OfxRectD* region)
    {
        HostClip* clip = clipOf(handle, "clipGetRegionOfDefinition");
        if (clip == nullptr) return ofx::statErrBadHandle;
        if (clip->hasGone || !clip->isConnected) return ofx::statFailed;
        *region = clip->region;
        return ofx::statOk;
    }
    static int abort(OfxImageEffectHandle handle)
    {
        HostEffect* effect = effectOf(handle, "abort");
        return effect != nullptr && effect->abort() ? 1 : 0;
    }
    static OfxStatus paramDefine(OfxParamSetHandle handle, const char* type, const char* name,
                                 OfxPropertySetHandle* set)
    {
        HostEffect* effect = effectOf(reinterpret_cast<OfxImageEffectHandle>(handle), "paramDefine");
        if (effect == nullptr) return ofx::statErrBadHandle;
        if (action != ofx::action::describeInContext) misuse("paramDefine outside of describing");
        if (!isParameterType(type)) return misuse(std::string("no type of parameter: ") + type), ofx::statErrUnknown;
        if (effect->parameters_.contains(name))
            return misuse(std::string("defined twice: ") + name), ofx::statErrExists;
        auto& made = effect->parameters_[name] = std::make_unique<PropertySet>(type);
        made->put(ofx::prop::name, {std::string(name)});
        if (set != nullptr) *set = made->handle();
        return ofx::statOk;
    }
    static OfxStatus paramGetHandle(OfxParamSetHandle handle, const char* name, OfxParamHandle* parameter,
                                    OfxPropertySetHandle* set)
    {
        HostEffect* effect = effectOf(reinterpret_cast<OfxImageEffectHandle>(handle), "paramGetHandle");
        if (effect == nullptr) return ofx::statErrBadHandle;
        if (!effect->isInstance_) misuse("paramGetHandle of a description");
        const auto at = effect->parameters_.find(name);
        if (at == effect->parameters_.end()) return ofx::statErrUnknown;
        *parameter = reinterpret_cast<OfxParamHandle>(at->second.get());
        if (set != nullptr) *set = at->second->handle();
        return ofx::statOk;
    }
    static OfxStatus valueAt(OfxParamHandle handle, OfxTime time, va_list to)
    {
        if (acting == nullptr) return misuse("a value asked for from a thread without an action"), ofx::statFailed;
        if (!isLiving(handle)) return misuse("a value of a parameter that does not live"), ofx::statErrBadHandle;
        auto& set = *reinterpret_cast<PropertySet*>(handle);
        acting->giveValue(set.text(ofx::prop::name), set.kind, time, to);
        return ofx::statOk;
    }
    static OfxStatus paramGetValue(OfxParamHandle handle, ...)
    {
        va_list to;
        va_start(to, handle);
        const OfxStatus status = valueAt(handle, acting != nullptr ? state.time : 0, to);
        va_end(to);
        return status;
    }
    static OfxStatus paramGetValueAtTime(OfxParamHandle handle, OfxTime time, ...)
    {
        va_list to;
        va_start(to, time);
        const OfxStatus status = valueAt(handle, time, to);
        va_end(to);
        return status;
    }
    static OfxStatus message(void*, const char*, const char*, const char* format, ...)
    {
        char text[2000];
        va_list values;
        va_start(values, format);
        std::vsnprintf(text, sizeof text, format, values);
        va_end(values);
        const std::lock_guard lock(mutexOfHost());
        current->messages.push_back(text);
        return ofx::statOk;
    }
    static OfxStatus clearMessage(void* effect)
    {
        if (effect == nullptr || !isLiving(effect))
            return misuse("a message cleared of no effect"), ofx::statErrBadHandle;
        return ofx::statOk;
    }
};

namespace {

using Handle = OfxPropertySetHandle;

const OfxPropertySuiteV1 propertySuite = {
    [](Handle s, const char* p, int i, void* v) { return put<void*>(s, p, i, v, 'p'); },
    [](Handle s, const char* p, int i, const char* v) { return put<std::string>(s, p, i, v, 's'); },
    [](Handle s, const char* p, int i, double v) { return put<double>(s, p, i, v, 'd'); },
    [](Handle s, const char* p, int i, int v) { return put<int>(s, p, i, v, 'i'); },
    nullptr,
    nullptr,
    [](Handle s, const char* p, int n, const double* v) {
        OfxStatus status = ofx::statOk;
        for (int i = 0; i < n && status == ofx::statOk; ++i) status = put<double>(s, p, i, v[i], 'd');
        return status;
    },
    nullptr,
    [](Handle s, const char* p, int i, void** v) { return take<void*>(s, p, i, v, 'p'); },
    [](Handle s, const char* p, int i, char** v) { return take<std::string>(s, p, i, v, 's'); },
    [](Handle s, const char* p, int i, double* v) { return take<double>(s, p, i, v, 'd'); },
    [](Handle s, const char* p, int i, int* v) { return take<int>(s, p, i, v, 'i'); },
    nullptr,
    nullptr,
    [](Handle s, const char* p, int n, double* v) {
        OfxStatus status = ofx::statOk;
        for (int i = 0; i < n && status == ofx::statOk; ++i) status = take<double>(s, p, i, v + i, 'd');
        return status;
    },
    [](Handle s, const char* p, int n, int* v) {
        OfxStatus status = ofx::statOk;
        for (int i = 0; i < n && status == ofx::statOk; ++i) status = take<int>(s, p, i, v + i, 'i');
        return status;
    },
    nullptr,
    nullptr,
};

const OfxImageEffectSuiteV1 effectSuite = {Suites::getPropertySet,
                                           Suites::getParamSet,
                                           Suites::clipDefine,
                                           Suites::clipGetHandle,
                                           Suites::clipGetPropertySet,
                                           Suites::clipGetImage,
                                           Suites::clipReleaseImage,
                                           Suites::clipGetRegion,
                                           Suites::abort,
                                           nullptr,
                                           nullptr,
                                           nullptr,
                                           nullptr};

const OfxParameterSuiteV1 parameterSuite = {Suites::paramDefine,
                                            Suites::paramGetHandle,
                                            nullptr,
                                            nullptr,
                                            Suites::paramGetValue,
                                            Suites::paramGetValueAtTime,
                                            nullptr,
                                            nullptr,
                                            nullptr,
                                            nullptr,
                                            nullptr,
                                            nullptr,
                                            nullptr,
                                            nullptr,
                                            nullptr,
                                            nullptr,
                                            nullptr,
                                            nullptr};

const OfxMessageSuiteV1 messageSuite1 = {Suites::message};
const OfxMessageSuiteV2 messageSuite2 = {Suites::message, Suites::message, Suites::clearMessage};

}  // namespace

namespace inside {

const void* fetchSuite(OfxPropertySetHandle, const char* name, int version)
{
    const std::string suite = name;
    const HostKind& kind = current->kind();
    if (suite == kind.missingSuite) return nullptr;
    if (suite == ofx::suite::property && version == 1) return &propertySuite;
    if (suite == ofx::suite::imageEffect && version == 1) return &effectSuite;
    if (suite == ofx::suite::parameter && version == 1) return &parameterSuite;
    if (suite == ofx::suite::message && version == 1 && kind.messages) return &messageSuite1;
    if (suite == ofx::suite::message && version == 2 && kind.messagesStay) return &messageSuite2;
    return nullptr;
}

}  // namespace inside

OfxHostOfTests::OfxHostOfTests(HostKind kind)
    : kind_(std::move(kind)), properties_("host"), host_{properties_.handle(), fetchSuite}
{
    current = this;
    if (kind_.isPoor) return;
    properties_.put(ofx::prop::name, {std::string("org.virga.tests")});
    properties_.put(ofx::prop::temporalClipAccess, {kind_.temporalAccess ? 1 : 0});
    properties_.put(ofx::prop::multipleClipDepths, {kind_.multipleDepths ? 1 : 0});
    if (kind_.managesColour)
        properties_.put(ofx::prop::colourStyle, {std::string("OfxImageEffectColourManagementFull")});
}

OfxHostOfTests::~OfxHostOfTests()
{
    close();
    current = nullptr;
}

OfxPlugin* OfxHostOfTests::open(const std::string& binary)
{
    binary_ = dlopen(binary.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (binary_ == nullptr) return misuses.push_back(dlerror()), nullptr;
    const auto count = reinterpret_cast<int (*)()>(dlsym(binary_, "OfxGetNumberOfPlugins"));
    const auto get = reinterpret_cast<OfxPlugin* (*)(int)>(dlsym(binary_, "OfxGetPlugin"));
    if (count == nullptr || get == nullptr) return misuses.push_back("the two entry points are missing"), nullptr;
    if (count() != 1) return misuses.push_back("not one plug-in"), nullptr;
    if (get(-1) != nullptr || get(1) != nullptr) misuses.push_back("plug-ins beyond the count");
    OfxPlugin* plugin = get(0);
    plugin->setHost(&host_);
    return plugin;
}

void OfxHostOfTests::close()
{
    if (binary_ != nullptr) dlclose(binary_);
    binary_ = nullptr;
}

}  // namespace virga::test
