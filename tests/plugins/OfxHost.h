// A small OpenFX host that is hard to please: it holds a plug-in to the standard and notes every misuse.
//
// Misuses: handles that do not live, properties that the standard does not give to that kind of object or of another
// type, parameters and clips defined outside of describing, images kept beyond the action that fetched them, suites
// called from threads that no action runs on.
#pragma once

#include <cstdarg>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "core/Image.h"
#include "ofx/abi/Ofx.h"

namespace virga::test {

/// What this host can do; the default is a rich one.
struct HostKind {
    bool messagesStay = true;  ///< message suite 2
    bool messages = true;      ///< message suite 1
    bool temporalAccess = true;
    bool multipleDepths = true;
    bool managesColour = false;  ///< 1.5
    bool isPoor = false;         ///< gives no property that the standard lets it leave out
    std::string missingSuite{};
};

struct OfxProperty {
    std::vector<std::variant<int, double, std::string, void*>> values;
};

/// The kinds of property sets, by the standard's names.
struct PropertySet {
    std::string kind;
    std::map<std::string, OfxProperty> properties;

    explicit PropertySet(std::string what);
    ~PropertySet();
    PropertySet(const PropertySet&) = delete;
    OfxPropertySetHandle handle() { return reinterpret_cast<OfxPropertySetHandle>(this); }
    void put(const std::string& name, std::vector<std::variant<int, double, std::string, void*>> values)
    {
        properties[name] = {std::move(values)};
    }
    std::string text(const std::string& name, std::size_t index = 0) const;
    double number(const std::string& name, std::size_t index = 0) const;  // of whole numbers too
    std::size_t count(const std::string& name) const;
};

/// Frames of a clip and how the host hands them out.
struct HostClip {
    std::string name, components = ofx::value::componentRgba, depth = ofx::value::depthFloat,
                      alpha = ofx::value::premultiplied;
    bool isConnected = true;
    OfxRectD region{};  ///< of definition, canonical
    double aspect = 1, fps = 25, first = 0, last = 0;
    bool rowsGoDown = false;  ///< row bytes are negative
    int spareBytes = 0;       ///< at the end of each row
    /// Scene values of a frame, R G B A, top row first, of the whole region at scale 1.
    std::function<ImageF(double time)> frame;
    std::string colourspace;
    bool hasGone = false;  ///< no image comes

    std::unique_ptr<PropertySet> properties;
    std::vector<double> asked;  ///< times of all images fetched
};

class OfxHostOfTests {
public:
    explicit OfxHostOfTests(HostKind kind = {});
    ~OfxHostOfTests();

    const HostKind& kind() const { return kind_; }
    /// Loads the bundle's binary and takes the plug-in through setHost. Null: what went wrong is a misuse.
    OfxPlugin* open(const std::string& binary);
    void close();

    std::vector<std::string> misuses;
    std::vector<std::string> messages;  ///< posted, in order; "(cleared)"

    OfxHost* host() { return &host_; }

private:
    HostKind kind_;
    PropertySet properties_;
    OfxHost host_;
    void* binary_ = nullptr;
};

/// An effect's description in one context, or an instance of it.
struct HostImage;

class HostEffect {
public:
    HostEffect(OfxHostOfTests& host, OfxPlugin& plugin, std::string context);
    ~HostEffect();

    /// Calls the plug-in's entry point; notes images that are not released and exceptions.
    OfxStatus act(const char* action, PropertySet* in = nullptr, PropertySet* out = nullptr);
    OfxStatus describe();  ///< describe, and describeInContext
    OfxStatus create();    ///< an instance, from the description
    OfxStatus destroy();

    void set(const std::string& name, double value);
    void set(const std::string& name, const std::string& value);
    void animate(const std::string& name, std::function<double(double time)> value)
    {
        curves_[name] = std::move(value);
    }
    PropertySet& parameter(const std::string& name) { return *parameters_.at(name); }
    bool hasParameter(const std::string& name) const { return parameters_.contains(name); }
    const std::map<std::string, std::unique_ptr<PropertySet>>& parameters() const { return parameters_; }
    HostClip& clip(const std::string& name) { return *clips_.at(name); }
    bool hasClip(const std::string& name) const { return clips_.contains(name); }
    PropertySet& description() { return description_; }
    PropertySet& instance() { return instance_; }

    struct Rendered {
        OfxStatus status;
        ImageF pixels;  ///< of the window, top row first, R G B A in 0..1 (integers) or as they are
    };
    Rendered render(double time, const OfxRectI& window, double scale = 1);
    bool isIdentity(double time, std::string* clip = nullptr);
    /// By the clip's name, canonical.
    std::map<std::string, OfxRectD> regionsOfInterest(double time, const OfxRectD& region, double scale = 1);

    std::function<bool()> abort = [] { return false; };
    std::vector<std::pair<double, double>> framesNeeded(double time);

private:
    friend struct Suites;
    void makeInstance(HostClip& clip) const;
    void layImage(HostImage& image, const HostClip& clip, double time, const OfxRectD* region) const;
    void giveValue(const std::string& name, const std::string& type, double time, va_list to);
    double valueOf(const std::string& name, double time, std::size_t index = 0) const;

    OfxHostOfTests& host_;
    OfxPlugin& plugin_;
    std::string context_;
    bool isInstance_ = false;
    PropertySet description_{"descriptor"}, instance_{"instance"};
    std::map<std::string, std::unique_ptr<PropertySet>> parameters_;
    std::map<std::string, std::unique_ptr<HostClip>> clips_;
    std::map<std::string, std::vector<double>> numbers_;
    std::map<std::string, std::string> texts_;
    std::map<std::string, std::function<double(double)>> curves_;
};

}  // namespace virga::test
