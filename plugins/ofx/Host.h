// The host as the plug-in sees it: its suites, and properties that may not be there.
//
// Hosts differ in what they have. A suite that is asked for and missing is null; a property that a host does not know
// is no error when it is set, and a fallback when it is read. What cannot be done without is refused once, in load.
#pragma once

#include <array>
#include <optional>
#include <stdexcept>
#include <string>

#include "abi/Ofx.h"

namespace virga::ofxplugin {

/// What ends an action: the status that the host gets, and a sentence for the artist.
struct Failure : std::runtime_error {
    Failure(OfxStatus code, const std::string& sentence) : std::runtime_error(sentence), status(code) {}
    OfxStatus status;
};

class Host {
public:
    /// Takes the host's address; calls nothing (OfxPlugin::setHost must not).
    void meet(OfxHost* host) noexcept { host_ = host; }
    /// Fetches the suites. Throws Failure(statErrMissingHostFeature) naming one that is needed and missing.
    void fetchSuites();

    const OfxPropertySuiteV1& property() const { return *property_; }
    const OfxImageEffectSuiteV1& effect() const { return *effect_; }
    const OfxParameterSuiteV1& parameter() const { return *parameter_; }
    OfxPropertySetHandle properties() const { return host_ != nullptr ? host_->host : nullptr; }

    /// Shows a sentence on the effect, where it stays until cleared; as a message where hosts know no such.
    void showError(OfxImageEffectHandle effect, const char* sentence) const noexcept;
    void clearError(OfxImageEffectHandle effect) const noexcept;

private:
    const void* fetch(const char* name, int version) const;

    OfxHost* host_ = nullptr;
    const OfxPropertySuiteV1* property_ = nullptr;
    const OfxImageEffectSuiteV1* effect_ = nullptr;
    const OfxParameterSuiteV1* parameter_ = nullptr;
    const OfxMessageSuiteV1* message_ = nullptr;            // optional
    const OfxMessageSuiteV2* persistentMessage_ = nullptr;  // optional
};

/// The one host of the process: OpenFX gives it to the binary, before anything else.
Host& host();

/// A set of properties of the host's. A null set has none.
class Properties {
public:
    explicit Properties(OfxPropertySetHandle set) : set_(set) {}
    OfxPropertySetHandle handle() const { return set_; }

    /// False if the host does not take it.
    bool set(const char* name, const char* value, int index = 0) const;
    bool set(const char* name, const std::string& value, int index = 0) const
    {
        return set(name, value.c_str(), index);
    }
    bool set(const char* name, double value, int index = 0) const;
    bool set(const char* name, int value, int index = 0) const;
    bool set(const char* name, void* value) const;
    template <std::size_t N>
    bool set(const char* name, const std::array<double, N>& values) const
    {
        return set_ != nullptr && host().property().propSetDoubleN(set_, name, int(N), values.data()) == ofx::statOk;
    }

    std::string text(const char* name, int index = 0) const;  ///< "" if there is none
    int whole(const char* name, int fallback) const;
    double number(const char* name, double fallback) const;
    void* pointer(const char* name) const;
    template <std::size_t N>
    std::optional<std::array<double, N>> numbers(const char* name) const
    {
        std::array<double, N> values{};
        if (set_ == nullptr || host().property().propGetDoubleN(set_, name, int(N), values.data()) != ofx::statOk)
            return std::nullopt;
        return values;
    }
    std::optional<OfxRectI> rectangle(const char* name) const;

private:
    OfxPropertySetHandle set_;
};

}  // namespace virga::ofxplugin
