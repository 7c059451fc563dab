// Where a host finds things: the order of the suites' functions, the layout of what it reads, and the words that are
// not simply their names in the standard.
#include <gtest/gtest.h>

#include <cstddef>

#include "ofx/abi/Ofx.h"

namespace {

template <class Suite, class Function>
std::size_t placeOf(Function Suite::*member)
{
    const Suite suite{};
    return std::size_t(reinterpret_cast<const char*>(&(suite.*member)) - reinterpret_cast<const char*>(&suite)) /
           sizeof(void*);
}

TEST(OfxAbi, PlacesOfFunctions)
{
    EXPECT_EQ(sizeof(OfxPropertySuiteV1), 18 * sizeof(void*));
    EXPECT_EQ(placeOf(&OfxPropertySuiteV1::propSetPointer), 0U);
    EXPECT_EQ(placeOf(&OfxPropertySuiteV1::propSetString), 1U);
    EXPECT_EQ(placeOf(&OfxPropertySuiteV1::propSetDouble), 2U);
    EXPECT_EQ(placeOf(&OfxPropertySuiteV1::propSetInt), 3U);
    EXPECT_EQ(placeOf(&OfxPropertySuiteV1::propSetDoubleN), 6U);
    EXPECT_EQ(placeOf(&OfxPropertySuiteV1::propGetPointer), 8U);
    EXPECT_EQ(placeOf(&OfxPropertySuiteV1::propGetString), 9U);
    EXPECT_EQ(placeOf(&OfxPropertySuiteV1::propGetDouble), 10U);
    EXPECT_EQ(placeOf(&OfxPropertySuiteV1::propGetInt), 11U);
    EXPECT_EQ(placeOf(&OfxPropertySuiteV1::propGetDoubleN), 14U);
    EXPECT_EQ(placeOf(&OfxPropertySuiteV1::propGetIntN), 15U);
    EXPECT_EQ(placeOf(&OfxPropertySuiteV1::propGetDimension), 17U);

    EXPECT_EQ(sizeof(OfxImageEffectSuiteV1), 13 * sizeof(void*));
    EXPECT_EQ(placeOf(&OfxImageEffectSuiteV1::getPropertySet), 0U);
    EXPECT_EQ(placeOf(&OfxImageEffectSuiteV1::getParamSet), 1U);
    EXPECT_EQ(placeOf(&OfxImageEffectSuiteV1::clipDefine), 2U);
    EXPECT_EQ(placeOf(&OfxImageEffectSuiteV1::clipGetHandle), 3U);
    EXPECT_EQ(placeOf(&OfxImageEffectSuiteV1::clipGetPropertySet), 4U);
    EXPECT_EQ(placeOf(&OfxImageEffectSuiteV1::clipGetImage), 5U);
    EXPECT_EQ(placeOf(&OfxImageEffectSuiteV1::clipReleaseImage), 6U);
    EXPECT_EQ(placeOf(&OfxImageEffectSuiteV1::clipGetRegionOfDefinition), 7U);
    EXPECT_EQ(placeOf(&OfxImageEffectSuiteV1::abort), 8U);

    EXPECT_EQ(sizeof(OfxParameterSuiteV1), 18 * sizeof(void*));
    EXPECT_EQ(placeOf(&OfxParameterSuiteV1::paramDefine), 0U);
    EXPECT_EQ(placeOf(&OfxParameterSuiteV1::paramGetHandle), 1U);
    EXPECT_EQ(placeOf(&OfxParameterSuiteV1::paramGetValue), 4U);
    EXPECT_EQ(placeOf(&OfxParameterSuiteV1::paramGetValueAtTime), 5U);
    EXPECT_EQ(placeOf(&OfxParameterSuiteV1::paramEditEnd), 17U);

    EXPECT_EQ(sizeof(OfxMessageSuiteV1), sizeof(void*));
    EXPECT_EQ(placeOf(&OfxMessageSuiteV2::setPersistentMessage), 1U);
    EXPECT_EQ(placeOf(&OfxMessageSuiteV2::clearPersistentMessage), 2U);
}

TEST(OfxAbi, LayoutOfWhatIsRead)
{
    EXPECT_EQ(offsetof(OfxHost, host), 0U);
    EXPECT_EQ(offsetof(OfxHost, fetchSuite), sizeof(void*));
    EXPECT_EQ(offsetof(OfxPlugin, pluginApi), 0U);
    EXPECT_EQ(offsetof(OfxPlugin, apiVersion), 8U);
    EXPECT_EQ(offsetof(OfxPlugin, pluginIdentifier), 16U);
    EXPECT_EQ(offsetof(OfxPlugin, pluginVersionMajor), 24U);
    EXPECT_EQ(offsetof(OfxPlugin, pluginVersionMinor), 28U);
    EXPECT_EQ(offsetof(OfxPlugin, setHost), 32U);
    EXPECT_EQ(offsetof(OfxPlugin, mainEntry), 40U);
    EXPECT_EQ(sizeof(OfxRectD), 32U);
    EXPECT_EQ(sizeof(OfxRectI), 16U);
}

TEST(OfxAbi, WordsThatAreNotTheirNames)
{
    EXPECT_STREQ(ofx::imageEffectApi, "OfxImageEffectPluginAPI");  // ...PluginApi
    EXPECT_STREQ(ofx::prop::multipleClipDepths,
                 "OfxImageEffectPropMultipleClipDepths");                               // ...SupportsMultipleClipDepths
    EXPECT_STREQ(ofx::prop::projectPixelAspect, "OfxImageEffectPropPixelAspectRatio");  // ...ProjectPixelAspectRatio
    EXPECT_STREQ(ofx::value::premultiplied, "OfxImageAlphaPremultiplied");              // ImagePreMultiplied
    EXPECT_STREQ(ofx::value::unpremultiplied, "OfxImageAlphaUnPremultiplied");          // ImageUnPreMultiplied
    EXPECT_STREQ(ofx::value::fieldNone, "OfxFieldNone");                                // ImageFieldNone
    EXPECT_EQ(ofx::statReplyDefault, 14);
    EXPECT_EQ(ofx::statErrMissingHostFeature, 4);
}

}  // namespace
