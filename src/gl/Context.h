// A headless OpenGL 4.5 core context through EGL: device platform first (any GPU, or Mesa's software renderer), then
// Mesa's surfaceless platform. No window system is needed.
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace virga::gl {

struct DeviceInfo {
    int index = 0;  ///< for `--device N`
    bool isSoftware = false;
    std::string renderer;  ///< GL_RENDERER
    std::string vendor;
    std::string version;   ///< GL_VERSION
    std::string platform;  ///< "device" or "surfaceless"
};

/// Owns the context and is current on the thread that made it, from construction to destruction, unless another is made
/// current there. All objects of this floor live and die on that thread, between the two, while it is current.
class Context {
public:
    /// device: "auto" (a GPU if there is one), "cpu", "gpu", or a number as listed by listDevices().
    /// Throws Error(Graphics) saying what was tried, Error(InvalidArgument) for another word.
    explicit Context(const std::string& device = "auto");
    ~Context();
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;

    const DeviceInfo& device() const;

    /// For threads with several contexts: the GL calls that follow are this one's. Throws Error(Graphics) if it is
    /// lost.
    void makeCurrent() const;
    bool tryMakeCurrent() const noexcept;
    /// The thread's that is current, or null.
    static const Context* current() noexcept;

    /// Throws Error(Graphics) naming `where` if GL has recorded an error since the last call.
    void check(const char* where) const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Every device that gives a usable context. Makes and destroys one context each: for `virga info`.
std::vector<DeviceInfo> listDevices();

/// Whether `device` is a word or number that Context understands ("auto", "cpu", "gpu", "0", "1", ...).
bool isDeviceName(const std::string& device);

}  // namespace virga::gl
