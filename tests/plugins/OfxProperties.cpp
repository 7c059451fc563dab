// The standard's table of properties, and the sets of them.
#include <mutex>
#include <set>

#include "OfxHostInside.h"

namespace virga::test::inside {

namespace {
std::mutex mutex;
std::set<const void*> living;  // all objects behind handles
}  // namespace

std::mutex& mutexOfHost() { return mutex; }

OfxHostOfTests* current = nullptr;
thread_local HostEffect* acting = nullptr;
thread_local std::string action;

void misuse(const std::string& what)
{
    const std::lock_guard lock(mutex);
    if (current != nullptr) current->misuses.push_back(what + (action.empty() ? "" : " (in " + action + ")"));
}

bool isLiving(const void* object)
{
    const std::lock_guard lock(mutex);
    return living.contains(object);
}

void bear(const void* object)
{
    const std::lock_guard lock(mutex);
    living.insert(object);
}

void bury(const void* object)
{
    const std::lock_guard lock(mutex);
    living.erase(object);
}

namespace {

/// The standard's properties by kind of object: 'i' whole, 'd' double, 's' string, 'p' pointer. One word a property.
const std::map<std::string, std::map<std::string, char>>& standard()
{
    using namespace ofx::prop;
    static const std::map<std::string, char> parameterCommon = {
        {type, 's'},   {name, 's'}, {label, 's'},      {shortLabel, 's'}, {longLabel, 's'}, {paramType, 's'},
        {secret, 'i'}, {hint, 's'}, {scriptName, 's'}, {parent, 's'},     {enabled, 'i'},   {icon, 's'}};
    static const auto with = [](std::map<std::string, char> all, const std::map<std::string, char>& more) {
        all.insert(more.begin(), more.end());
        return all;
    };
    static const std::map<std::string, char> value = {{animates, 'i'}, {evaluateOnChange, 'i'}};
    static const auto numeric = [](char t) {
        return std::map<std::string, char>{
            {defaultValue, t}, {least, t}, {most, t}, {displayLeast, t}, {displayMost, t}};
    };
    static const std::map<std::string, std::map<std::string, char>> all = {
        {"host",
         {{apiVersion, 'i'},
          {type, 's'},
          {name, 's'},
          {label, 's'},
          {version, 'i'},
          {versionLabel, 's'},
          {supportsMultiResolution, 'i'},
          {supportsTiles, 'i'},
          {temporalClipAccess, 'i'},
          {supportedComponents, 's'},
          {supportedContexts, 's'},
          {multipleClipDepths, 'i'},
          {multipleClipPars, 'i'},
          {colourStyle, 's'},
          {colourConfigs, 's'},
          {supportedPixelDepths, 's'}}},
        {"descriptor",
         {{type, 's'},
          {label, 's'},
          {shortLabel, 's'},
          {longLabel, 's'},
          {version, 'i'},
          {versionLabel, 's'},
          {description, 's'},
          {supportedContexts, 's'},
          {grouping, 's'},
          {singleInstance, 'i'},
          {threadSafety, 's'},
          {hostFrameThreading, 'i'},
          {supportsMultiResolution, 'i'},
          {supportsTiles, 'i'},
          {temporalClipAccess, 'i'},
          {supportedPixelDepths, 's'},
          {fieldRenderTwiceAlways, 'i'},
          {multipleClipDepths, 'i'},
          {multipleClipPars, 'i'},
          {colourStyle, 's'},
          {colourConfigs, 's'}}},
        {"instance",
         {{type, 's'},
          {context, 's'},
          {instanceData, 'p'},
          {projectSize, 'd'},
          {projectOffset, 'd'},
          {projectPixelAspect, 'd'},
          {sequentialRender, 'i'},
          {supportsTiles, 'i'},
          {frameRate, 'd'},
          {isInteractive, 'i'},
          {label, 's'}}},
        {"clip descriptor",
         {{type, 's'},
          {name, 's'},
          {label, 's'},
          {shortLabel, 's'},
          {longLabel, 's'},
          {supportedComponents, 's'},
          {temporalClipAccess, 'i'},
          {optional, 'i'},
          {fieldExtraction, 's'},
          {isMask, 'i'},
          {supportsTiles, 'i'}}},
        {"clip",
         {{type, 's'},
          {name, 's'},
          {label, 's'},
          {pixelDepth, 's'},
          {components, 's'},
          {preMultiplication, 's'},
          {pixelAspect, 'd'},
          {frameRate, 'd'},
          {frameRange, 'd'},
          {connected, 'i'},
          {clipColourspace, 's'}}},
        {"image",
         {{type, 's'},
          {pixelDepth, 's'},
          {components, 's'},
          {preMultiplication, 's'},
          {renderScale, 'd'},
          {pixelAspect, 'd'},
          {data, 'p'},
          {bounds, 'i'},
          {imageRegionOfDefinition, 'i'},
          {rowBytes, 'i'},
          {field, 's'},
          {uniqueIdentifier, 's'}}},
        {ofx::value::paramGroup, with(parameterCommon, {{groupOpen, 'i'}})},
        {ofx::value::paramBoolean, with(with(parameterCommon, value), {{defaultValue, 'i'}})},
        {ofx::value::paramInteger, with(with(parameterCommon, value), numeric('i'))},
        {ofx::value::paramChoice, with(with(parameterCommon, value), {{defaultValue, 'i'}, {choiceOption, 's'}})},
        {ofx::value::paramString,
         with(with(parameterCommon, value), {{defaultValue, 's'}, {stringMode, 's'}, {filePathExists, 'i'}})},
        {ofx::value::paramDouble,
         with(with(with(parameterCommon, value), numeric('d')), {{increment, 'd'}, {digits, 'i'}, {doubleType, 's'}})},
        {ofx::value::paramDouble2D, with(with(with(parameterCommon, value), numeric('d')),
                                         {{increment, 'd'}, {digits, 'i'}, {doubleType, 's'}, {dimensionLabel, 's'}})},
        {ofx::value::paramRgb, with(with(parameterCommon, value), {{defaultValue, 'd'}})},
        {"in describe in context", {{context, 's'}}},
        {"in render",
         {{ofx::prop::time, 'd'},
          {fieldToRender, 's'},
          {renderWindow, 'i'},
          {renderScale, 'd'},
          {frameRange, 'd'},
          {type, 's'},
          {name, 's'},
          {changeReason, 's'},
          {isInteractive, 'i'}}},
        {"in regions", {{ofx::prop::time, 'd'}, {renderScale, 'd'}, {regionOfInterest, 'd'}}},
        {"out regions", {}},
        {"out definition", {{regionOfDefinition, 'd'}}},
        {"out frames", {}},
        {"out identity", {{name, 's'}, {ofx::prop::time, 'd'}}},
        {"out preferences", {{frameRate, 'd'}, {preMultiplication, 's'}, {frameVarying, 'i'}}},
        {"out colourspace", {{clipColourspace, 's'}}},
    };
    return all;
}

/// Properties that are named after a clip.
char typeOfClipProperty(const std::string& kind, const std::string& property)
{
    const auto begins = [&](const char* with) { return property.starts_with(with); };
    if (kind == "out regions" && begins(ofx::prop::clipRegionOfInterest)) return 'd';
    if (kind == "out frames" && begins(ofx::prop::clipFrameRange)) return 'd';
    if (kind == "out preferences" && (begins(ofx::prop::clipComponents) || begins(ofx::prop::clipDepth))) return 's';
    if (kind == "out preferences" && begins(ofx::prop::clipPreferredColourspaces) && current->kind().managesColour)
        return 's';
    return 0;
}

}  // namespace

char typeOf(const PropertySet& set, const std::string& property)
{
    const auto& known = standard().at(set.kind);
    const auto at = known.find(property);
    return at != known.end() ? at->second : typeOfClipProperty(set.kind, property);
}

bool isParameterType(const std::string& type) { return type.starts_with("OfxParamType") && standard().contains(type); }

}  // namespace virga::test::inside

namespace virga::test {

using namespace inside;

PropertySet::PropertySet(std::string what) : kind(std::move(what)) { bear(this); }
PropertySet::~PropertySet() { bury(this); }

std::string PropertySet::text(const std::string& property, std::size_t index) const
{
    const auto at = properties.find(property);
    return at == properties.end() || index >= at->second.values.size()
               ? ""
               : std::get<std::string>(at->second.values[index]);
}

double PropertySet::number(const std::string& property, std::size_t index) const
{
    const auto& value = properties.at(property).values.at(index);
    return std::holds_alternative<int>(value) ? std::get<int>(value) : std::get<double>(value);
}

std::size_t PropertySet::count(const std::string& property) const
{
    const auto at = properties.find(property);
    return at == properties.end() ? 0 : at->second.values.size();
}

}  // namespace virga::test
