// The C interface between OpenFX hosts and plug-ins, as far as Virga uses it. Source: the OpenFX Image Effect Plug-in
// API, version 1.4 and, where marked, 1.5 (openfx.readthedocs.io, "OpenFX Reference").
//
// Names, values and the order of functions in a suite are the interface: a host finds properties by these very strings
// and functions by their place. Whatever is not called still holds its place. tests/plugins/ofx_abi_test.cpp has the
// sizes.
#pragma once

#include <cstddef>

extern "C" {

// ---- Words of the interface
// -------------------------------------------------------------------------------------------

using OfxStatus = int;
using OfxTime = double;  // in frames

struct OfxPropertySetStruct;
struct OfxImageEffectStruct;
struct OfxImageClipStruct;
struct OfxImageMemoryStruct;
struct OfxParamStruct;
struct OfxParamSetStruct;
using OfxPropertySetHandle = OfxPropertySetStruct*;
using OfxImageEffectHandle = OfxImageEffectStruct*;
using OfxImageClipHandle = OfxImageClipStruct*;
using OfxImageMemoryHandle = OfxImageMemoryStruct*;
using OfxParamHandle = OfxParamStruct*;
using OfxParamSetHandle = OfxParamSetStruct*;

struct OfxRangeD {
    double min, max;
};
struct OfxRectI {
    int x1, y1, x2, y2;  // x1 <= x < x2
};
struct OfxRectD {
    double x1, y1, x2, y2;
};

struct OfxHost {
    OfxPropertySetHandle host;
    const void* (*fetchSuite)(OfxPropertySetHandle host, const char* name, int version);
};

using OfxPluginEntryPoint = OfxStatus(const char* action, const void* handle, OfxPropertySetHandle inArgs,
                                      OfxPropertySetHandle outArgs);

struct OfxPlugin {
    const char* pluginApi;
    int apiVersion;
    const char* pluginIdentifier;
    unsigned int pluginVersionMajor, pluginVersionMinor;
    void (*setHost)(OfxHost* host);
    OfxPluginEntryPoint* mainEntry;
};

// ---- Suites
// -----------------------------------------------------------------------------------------------------------

struct OfxPropertySuiteV1 {
    OfxStatus (*propSetPointer)(OfxPropertySetHandle, const char* name, int index, void* value);
    OfxStatus (*propSetString)(OfxPropertySetHandle, const char* name, int index, const char* value);
    OfxStatus (*propSetDouble)(OfxPropertySetHandle, const char* name, int index, double value);
    OfxStatus (*propSetInt)(OfxPropertySetHandle, const char* name, int index, int value);
    OfxStatus (*propSetPointerN)(OfxPropertySetHandle, const char* name, int count, void* const* values);
    OfxStatus (*propSetStringN)(OfxPropertySetHandle, const char* name, int count, const char* const* values);
    OfxStatus (*propSetDoubleN)(OfxPropertySetHandle, const char* name, int count, const double* values);
    OfxStatus (*propSetIntN)(OfxPropertySetHandle, const char* name, int count, const int* values);
    OfxStatus (*propGetPointer)(OfxPropertySetHandle, const char* name, int index, void** value);
    OfxStatus (*propGetString)(OfxPropertySetHandle, const char* name, int index, char** value);
    OfxStatus (*propGetDouble)(OfxPropertySetHandle, const char* name, int index, double* value);
    OfxStatus (*propGetInt)(OfxPropertySetHandle, const char* name, int index, int* value);
    OfxStatus (*propGetPointerN)(OfxPropertySetHandle, const char* name, int count, void** values);
    OfxStatus (*propGetStringN)(OfxPropertySetHandle, const char* name, int count, char** values);
    OfxStatus (*propGetDoubleN)(OfxPropertySetHandle, const char* name, int count, double* values);
    OfxStatus (*propGetIntN)(OfxPropertySetHandle, const char* name, int count, int* values);
    OfxStatus (*propReset)(OfxPropertySetHandle, const char* name);
    OfxStatus (*propGetDimension)(OfxPropertySetHandle, const char* name, int* count);
};

struct OfxImageEffectSuiteV1 {
    OfxStatus (*getPropertySet)(OfxImageEffectHandle, OfxPropertySetHandle* properties);
    OfxStatus (*getParamSet)(OfxImageEffectHandle, OfxParamSetHandle* parameters);
    OfxStatus (*clipDefine)(OfxImageEffectHandle, const char* name, OfxPropertySetHandle* properties);
    OfxStatus (*clipGetHandle)(OfxImageEffectHandle, const char* name, OfxImageClipHandle* clip,
                               OfxPropertySetHandle* properties);
    OfxStatus (*clipGetPropertySet)(OfxImageClipHandle, OfxPropertySetHandle* properties);
    OfxStatus (*clipGetImage)(OfxImageClipHandle, OfxTime, const OfxRectD* region, OfxPropertySetHandle* image);
    OfxStatus (*clipReleaseImage)(OfxPropertySetHandle image);
    OfxStatus (*clipGetRegionOfDefinition)(OfxImageClipHandle, OfxTime, OfxRectD* bounds);
    int (*abort)(OfxImageEffectHandle);
    OfxStatus (*imageMemoryAlloc)(OfxImageEffectHandle, std::size_t bytes, OfxImageMemoryHandle*);
    OfxStatus (*imageMemoryFree)(OfxImageMemoryHandle);
    OfxStatus (*imageMemoryLock)(OfxImageMemoryHandle, void** memory);
    OfxStatus (*imageMemoryUnlock)(OfxImageMemoryHandle);
};

struct OfxParameterSuiteV1 {
    OfxStatus (*paramDefine)(OfxParamSetHandle, const char* type, const char* name, OfxPropertySetHandle* properties);
    OfxStatus (*paramGetHandle)(OfxParamSetHandle, const char* name, OfxParamHandle*, OfxPropertySetHandle* properties);
    OfxStatus (*paramSetGetPropertySet)(OfxParamSetHandle, OfxPropertySetHandle* properties);
    OfxStatus (*paramGetPropertySet)(OfxParamHandle, OfxPropertySetHandle* properties);
    OfxStatus (*paramGetValue)(OfxParamHandle, ...);
    OfxStatus (*paramGetValueAtTime)(OfxParamHandle, OfxTime, ...);
    OfxStatus (*paramGetDerivative)(OfxParamHandle, OfxTime, ...);
    OfxStatus (*paramGetIntegral)(OfxParamHandle, OfxTime, OfxTime, ...);
    OfxStatus (*paramSetValue)(OfxParamHandle, ...);
    OfxStatus (*paramSetValueAtTime)(OfxParamHandle, OfxTime, ...);
    OfxStatus (*paramGetNumKeys)(OfxParamHandle, unsigned int* count);
    OfxStatus (*paramGetKeyTime)(OfxParamHandle, unsigned int key, OfxTime* time);
    OfxStatus (*paramGetKeyIndex)(OfxParamHandle, OfxTime, int direction, int* index);
    OfxStatus (*paramDeleteKey)(OfxParamHandle, OfxTime);
    OfxStatus (*paramDeleteAllKeys)(OfxParamHandle);
    OfxStatus (*paramCopy)(OfxParamHandle to, OfxParamHandle from, OfxTime offset, const OfxRangeD* range);
    OfxStatus (*paramEditBegin)(OfxParamSetHandle, const char* name);
    OfxStatus (*paramEditEnd)(OfxParamSetHandle);
};

struct OfxMessageSuiteV1 {
    OfxStatus (*message)(void* effect, const char* type, const char* id, const char* format, ...);
};
struct OfxMessageSuiteV2 {
    OfxStatus (*message)(void* effect, const char* type, const char* id, const char* format, ...);
    OfxStatus (*setPersistentMessage)(void* effect, const char* type, const char* id, const char* format, ...);
    OfxStatus (*clearPersistentMessage)(void* effect);
};

}  // extern "C"

namespace ofx {

// ---- Status
// -----------------------------------------------------------------------------------------------------------

inline constexpr OfxStatus statOk = 0, statFailed = 1, statErrFatal = 2, statErrUnknown = 3,
                           statErrMissingHostFeature = 4, statErrUnsupported = 5, statErrExists = 6, statErrFormat = 7,
                           statErrMemory = 8, statErrBadHandle = 9, statErrBadIndex = 10, statErrValue = 11,
                           statReplyYes = 12, statReplyNo = 13, statReplyDefault = 14;

// ---- Strings
// ----------------------------------------------------------------------------------------------------------

using Word = const char[];

inline constexpr Word imageEffectApi = "OfxImageEffectPluginAPI";  // version 1

namespace suite {
inline constexpr Word property = "OfxPropertySuite", imageEffect = "OfxImageEffectSuite",
                      parameter = "OfxParameterSuite", message = "OfxMessageSuite";
}

namespace action {
inline constexpr Word load = "OfxActionLoad", unload = "OfxActionUnload", describe = "OfxActionDescribe",
                      createInstance = "OfxActionCreateInstance", destroyInstance = "OfxActionDestroyInstance",
                      instanceChanged = "OfxActionInstanceChanged",
                      beginInstanceChanged = "OfxActionBeginInstanceChanged",
                      endInstanceChanged = "OfxActionEndInstanceChanged", purgeCaches = "OfxActionPurgeCaches",
                      syncPrivateData = "OfxActionSyncPrivateData",
                      describeInContext = "OfxImageEffectActionDescribeInContext",
                      getRegionOfDefinition = "OfxImageEffectActionGetRegionOfDefinition",
                      getRegionsOfInterest = "OfxImageEffectActionGetRegionsOfInterest",
                      getTimeDomain = "OfxImageEffectActionGetTimeDomain",
                      getFramesNeeded = "OfxImageEffectActionGetFramesNeeded",
                      getClipPreferences = "OfxImageEffectActionGetClipPreferences",
                      isIdentity = "OfxImageEffectActionIsIdentity", render = "OfxImageEffectActionRender",
                      beginSequenceRender = "OfxImageEffectActionBeginSequenceRender",
                      endSequenceRender = "OfxImageEffectActionEndSequenceRender",
                      getOutputColourspace = "OfxImageEffectActionGetOutputColourspace";  // 1.5
}

namespace prop {
// Of everything.
inline constexpr Word apiVersion = "OfxPropAPIVersion", type = "OfxPropType", name = "OfxPropName",
                      label = "OfxPropLabel", shortLabel = "OfxPropShortLabel", longLabel = "OfxPropLongLabel",
                      version = "OfxPropVersion", versionLabel = "OfxPropVersionLabel",
                      description = "OfxPropPluginDescription", icon = "OfxPropIcon", time = "OfxPropTime",
                      isInteractive = "OfxPropIsInteractive", instanceData = "OfxPropInstanceData",
                      changeReason = "OfxPropChangeReason";
// Of effects.
inline constexpr Word supportedContexts = "OfxImageEffectPropSupportedContexts", context = "OfxImageEffectPropContext",
                      grouping = "OfxImageEffectPluginPropGrouping",
                      singleInstance = "OfxImageEffectPluginPropSingleInstance",
                      threadSafety = "OfxImageEffectPluginRenderThreadSafety",
                      hostFrameThreading = "OfxImageEffectPluginPropHostFrameThreading",
                      supportsMultiResolution = "OfxImageEffectPropSupportsMultiResolution",
                      supportsTiles = "OfxImageEffectPropSupportsTiles",
                      temporalClipAccess = "OfxImageEffectPropTemporalClipAccess",
                      supportedPixelDepths = "OfxImageEffectPropSupportedPixelDepths",
                      fieldRenderTwiceAlways = "OfxImageEffectPluginPropFieldRenderTwiceAlways",
                      multipleClipDepths = "OfxImageEffectPropMultipleClipDepths",
                      multipleClipPars = "OfxImageEffectPropSupportsMultipleClipPARs",
                      sequentialRender = "OfxImageEffectInstancePropSequentialRender",
                      frameVarying = "OfxImageEffectFrameVarying", frameRate = "OfxImageEffectPropFrameRate",
                      frameRange = "OfxImageEffectPropFrameRange", projectSize = "OfxImageEffectPropProjectSize",
                      projectOffset = "OfxImageEffectPropProjectOffset",
                      projectPixelAspect = "OfxImageEffectPropPixelAspectRatio",
                      renderScale = "OfxImageEffectPropRenderScale", renderWindow = "OfxImageEffectPropRenderWindow",
                      fieldToRender = "OfxImageEffectPropFieldToRender",
                      regionOfDefinition = "OfxImageEffectPropRegionOfDefinition",
                      regionOfInterest = "OfxImageEffectPropRegionOfInterest";
// Of clips and images.
inline constexpr Word supportedComponents = "OfxImageEffectPropSupportedComponents",
                      optional = "OfxImageClipPropOptional", isMask = "OfxImageClipPropIsMask",
                      connected = "OfxImageClipPropConnected", fieldExtraction = "OfxImageClipPropFieldExtraction",
                      pixelDepth = "OfxImageEffectPropPixelDepth", components = "OfxImageEffectPropComponents",
                      preMultiplication = "OfxImageEffectPropPreMultiplication",
                      pixelAspect = "OfxImagePropPixelAspectRatio", data = "OfxImagePropData",
                      bounds = "OfxImagePropBounds", imageRegionOfDefinition = "OfxImagePropRegionOfDefinition",
                      rowBytes = "OfxImagePropRowBytes", field = "OfxImagePropField",
                      uniqueIdentifier = "OfxImagePropUniqueIdentifier";
// Named after a clip: these and the clip's name.
inline constexpr Word clipComponents = "OfxImageClipPropComponents_", clipDepth = "OfxImageClipPropDepth_",
                      clipRegionOfInterest = "OfxImageClipPropRoI_", clipFrameRange = "OfxImageClipPropFrameRange_",
                      clipPreferredColourspaces = "OfxImageClipPropPreferredColourspaces_";  // 1.5
// Of parameters.
inline constexpr Word hint = "OfxParamPropHint", parent = "OfxParamPropParent", secret = "OfxParamPropSecret",
                      enabled = "OfxParamPropEnabled", animates = "OfxParamPropAnimates",
                      evaluateOnChange = "OfxParamPropEvaluateOnChange", scriptName = "OfxParamPropScriptName",
                      defaultValue = "OfxParamPropDefault", least = "OfxParamPropMin", most = "OfxParamPropMax",
                      displayLeast = "OfxParamPropDisplayMin", displayMost = "OfxParamPropDisplayMax",
                      increment = "OfxParamPropIncrement", digits = "OfxParamPropDigits",
                      doubleType = "OfxParamPropDoubleType", dimensionLabel = "OfxParamPropDimensionLabel",
                      choiceOption = "OfxParamPropChoiceOption", groupOpen = "OfxParamPropGroupOpen",
                      stringMode = "OfxParamPropStringMode", filePathExists = "OfxParamPropStringFilePathExists",
                      pageChild = "OfxParamPropPageChild", paramType = "OfxParamPropType";
// Colour management, 1.5.
inline constexpr Word colourStyle = "OfxImageEffectPropColourManagementStyle",
                      colourConfigs = "OfxImageEffectPropColourManagementAvailableConfigs",
                      clipColourspace = "OfxImageClipPropColourspace";
}  // namespace prop

namespace value {
inline constexpr Word contextFilter = "OfxImageEffectContextFilter", contextGeneral = "OfxImageEffectContextGeneral";
inline constexpr Word clipSource = "Source", clipOutput = "Output";
inline constexpr Word componentNone = "OfxImageComponentNone", componentRgba = "OfxImageComponentRGBA",
                      componentRgb = "OfxImageComponentRGB", componentAlpha = "OfxImageComponentAlpha";
inline constexpr Word depthNone = "OfxBitDepthNone", depthByte = "OfxBitDepthByte", depthShort = "OfxBitDepthShort",
                      depthHalf = "OfxBitDepthHalf", depthFloat = "OfxBitDepthFloat";
inline constexpr Word opaque = "OfxImageOpaque", premultiplied = "OfxImageAlphaPremultiplied",
                      unpremultiplied = "OfxImageAlphaUnPremultiplied";
inline constexpr Word fieldNone = "OfxFieldNone", fieldBoth = "OfxFieldBoth";
inline constexpr Word fullySafe = "OfxImageEffectRenderFullySafe";
inline constexpr Word typeClip = "OfxTypeClip", typeParameter = "OfxTypeParameter", typeImage = "OfxTypeImage",
                      typeEffect = "OfxTypeImageEffect", typeEffectInstance = "OfxTypeImageEffectInstance",
                      typeHost = "OfxTypeImageEffectHost", typeParameterInstance = "OfxTypeParameterInstance";
inline constexpr Word paramInteger = "OfxParamTypeInteger", paramDouble = "OfxParamTypeDouble",
                      paramBoolean = "OfxParamTypeBoolean", paramChoice = "OfxParamTypeChoice",
                      paramRgb = "OfxParamTypeRGB", paramDouble2D = "OfxParamTypeDouble2D",
                      paramString = "OfxParamTypeString", paramGroup = "OfxParamTypeGroup",
                      paramPage = "OfxParamTypePage";
inline constexpr Word doublePlain = "OfxParamDoubleTypePlain", doubleScale = "OfxParamDoubleTypeScale",
                      doubleAngle = "OfxParamDoubleTypeAngle";
inline constexpr Word stringFilePath = "OfxParamStringIsFilePath", stringSingleLine = "OfxParamStringIsSingleLine";
inline constexpr Word messageError = "OfxMessageError", messageWarning = "OfxMessageWarning";
inline constexpr Word changedByUser = "OfxChangeUserEdited";
// Colour management, 1.5. A basic space is any linear light; "OfxColourspace_" and a clip's name is that clip's space.
inline constexpr Word colourNone = "OfxImageEffectColourManagementNone",
                      colourBasic = "OfxImageEffectColourManagementBasic",
                      colourConfig = "ofx-native-v1.5_aces-v1.3_ocio-v2.3", sceneLinear = "ofx_scene_linear",
                      colourOfSource = "OfxColourspace_Source";
}  // namespace value

}  // namespace ofx
