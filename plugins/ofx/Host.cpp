#include "Host.h"

namespace virga::ofxplugin {

Host& host()
{
    static Host one;
    return one;
}

const void* Host::fetch(const char* name, int version) const { return host_->fetchSuite(host_->host, name, version); }

void Host::fetchSuites()
{
    if (host_ == nullptr || host_->fetchSuite == nullptr)
        throw Failure(ofx::statErrMissingHostFeature, "the host has not introduced itself (setHost)");
    property_ = static_cast<const OfxPropertySuiteV1*>(fetch(ofx::suite::property, 1));
    effect_ = static_cast<const OfxImageEffectSuiteV1*>(fetch(ofx::suite::imageEffect, 1));
    parameter_ = static_cast<const OfxParameterSuiteV1*>(fetch(ofx::suite::parameter, 1));
    message_ = static_cast<const OfxMessageSuiteV1*>(fetch(ofx::suite::message, 1));
    persistentMessage_ = static_cast<const OfxMessageSuiteV2*>(fetch(ofx::suite::message, 2));
    const char* missing = property_ == nullptr    ? ofx::suite::property
                          : effect_ == nullptr    ? ofx::suite::imageEffect
                          : parameter_ == nullptr ? ofx::suite::parameter
                                                  : nullptr;
    if (missing != nullptr)
        throw Failure(ofx::statErrMissingHostFeature, std::string("the host has no ") + missing + " version 1");
}

void Host::showError(OfxImageEffectHandle effect, const char* sentence) const noexcept
{
    if (effect != nullptr && persistentMessage_ != nullptr && persistentMessage_->setPersistentMessage != nullptr)
        persistentMessage_->setPersistentMessage(effect, ofx::value::messageError, "", "%s", sentence);
    else if (message_ != nullptr && message_->message != nullptr)
        message_->message(effect, ofx::value::messageError, "", "%s", sentence);
}

void Host::clearError(OfxImageEffectHandle effect) const noexcept
{
    if (effect != nullptr && persistentMessage_ != nullptr && persistentMessage_->clearPersistentMessage != nullptr)
        persistentMessage_->clearPersistentMessage(effect);
}

bool Properties::set(const char* name, const char* value, int index) const
{
    return set_ != nullptr && host().property().propSetString(set_, name, index, value) == ofx::statOk;
}

bool Properties::set(const char* name, double value, int index) const
{
    return set_ != nullptr && host().property().propSetDouble(set_, name, index, value) == ofx::statOk;
}

bool Properties::set(const char* name, int value, int index) const
{
    return set_ != nullptr && host().property().propSetInt(set_, name, index, value) == ofx::statOk;
}

bool Properties::set(const char* name, void* value) const
{
    return set_ != nullptr && host().property().propSetPointer(set_, name, 0, value) == ofx::statOk;
}

std::string Properties::text(const char* name, int index) const
{
    char* value = nullptr;
    if (set_ == nullptr || host().property().propGetString(set_, name, index, &value) != ofx::statOk) return "";
    return value != nullptr ? value : "";
}

int Properties::whole(const char* name, int fallback) const
{
    int value = fallback;
    if (set_ == nullptr || host().property().propGetInt(set_, name, 0, &value) != ofx::statOk) return fallback;
    return value;
}

double Properties::number(const char* name, double fallback) const
{
    double value = fallback;
    if (set_ == nullptr || host().property().propGetDouble(set_, name, 0, &value) != ofx::statOk) return fallback;
    return value;
}

void* Properties::pointer(const char* name) const
{
    void* value = nullptr;
    if (set_ == nullptr || host().property().propGetPointer(set_, name, 0, &value) != ofx::statOk) return nullptr;
    return value;
}

std::optional<OfxRectI> Properties::rectangle(const char* name) const
{
    std::array<int, 4> v{};
    if (set_ == nullptr || host().property().propGetIntN(set_, name, 4, v.data()) != ofx::statOk) return std::nullopt;
    return OfxRectI{v[0], v[1], v[2], v[3]};
}

}  // namespace virga::ofxplugin
