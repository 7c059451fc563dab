#include "gl/Context.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <cstring>

#include "core/Counters.h"
#include "core/Error.h"

namespace virga::gl {
namespace {

struct Candidate {
    int index;
    bool isSoftware;
    EGLDisplay display;
    const char* platform;
};

bool hasWord(const char* list, const char* word) { return list != nullptr && std::strstr(list, word) != nullptr; }

std::vector<Candidate> findCandidates()
{
    std::vector<Candidate> found;
    const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (hasWord(extensions, "EGL_EXT_platform_device") && hasWord(extensions, "EGL_EXT_device_base")) {
        EGLDeviceEXT devices[32];
        EGLint count = 0;
        if (eglQueryDevicesEXT(32, devices, &count)) {
            for (int i = 0; i < count; ++i) {
                const char* words = eglQueryDeviceStringEXT(devices[i], EGL_EXTENSIONS);
                EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr);
                if (display != EGL_NO_DISPLAY)
                    found.push_back({i, hasWord(words, "EGL_MESA_device_software"), display, "device"});
            }
        }
    }
    if (hasWord(extensions, "EGL_MESA_platform_surfaceless")) {
        EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
        if (display != EGL_NO_DISPLAY) found.push_back({int(found.size()), true, display, "surfaceless"});
    }
    return found;
}

/// An OpenGL 4.5 core context on `display`, current on this thread; EGL_NO_CONTEXT if it cannot be had.
EGLContext makeContext(EGLDisplay display)
{
    EGLint major = 0, minor = 0;
    if (!eglInitialize(display, &major, &minor) || !eglBindAPI(EGL_OPENGL_API)) return EGL_NO_CONTEXT;
    const EGLint attributes[] = {
        EGL_CONTEXT_MAJOR_VERSION,           4,       EGL_CONTEXT_MINOR_VERSION, 5, EGL_CONTEXT_OPENGL_PROFILE_MASK,
        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
    EGLContext context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    if (context == EGL_NO_CONTEXT) return EGL_NO_CONTEXT;
    if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
        eglDestroyContext(display, context);
        return EGL_NO_CONTEXT;
    }
    return context;
}

std::string text(GLenum name)
{
    const GLubyte* value = glGetString(name);
    return value ? reinterpret_cast<const char*>(value) : "";
}

DeviceInfo describe(const Candidate& candidate)
{
    return {candidate.index, candidate.isSoftware, text(GL_RENDERER),
            text(GL_VENDOR), text(GL_VERSION),     candidate.platform};
}

thread_local const Context* currentContext = nullptr;

void destroyContext(EGLDisplay display, EGLContext context)
{
    eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display, context);
}

/// Whether a candidate is what the user asked for by `device`.
bool isWanted(const Candidate& candidate, const std::string& device)
{
    if (device == "auto") return true;
    if (device == "cpu") return candidate.isSoftware;
    if (device == "gpu") return !candidate.isSoftware;
    return candidate.index == std::atoi(device.c_str());
}

}  // namespace

struct Context::Impl {
    EGLDisplay display = EGL_NO_DISPLAY;
    EGLContext context = EGL_NO_CONTEXT;
    DeviceInfo device;
};

bool isDeviceName(const std::string& device)
{
    if (device == "auto" || device == "cpu" || device == "gpu") return true;
    return !device.empty() && device.size() < 4 &&
           std::all_of(device.begin(), device.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
}

Context::Context(const std::string& device) : impl_(std::make_unique<Impl>())
{
    if (!isDeviceName(device))
        throw Error(ErrorCode::InvalidArgument, "device '{}': must be auto, cpu, gpu or a device number", device);

    std::vector<Candidate> candidates = findCandidates();
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.isSoftware < b.isSoftware; });
    for (const Candidate& candidate : candidates) {
        if (!isWanted(candidate, device)) continue;
        EGLContext context = makeContext(candidate.display);
        if (context == EGL_NO_CONTEXT) continue;
        impl_->display = candidate.display;
        impl_->context = context;
        impl_->device = describe(candidate);
        currentContext = this;
        ++counters().contexts;
        return;
    }
    const bool isNumber = std::isdigit(static_cast<unsigned char>(device[0])) != 0;
    if (isNumber && std::none_of(candidates.begin(), candidates.end(),
                                 [&](const Candidate& candidate) { return isWanted(candidate, device); }))
        throw Error(ErrorCode::Graphics,
                    "--device {}: there is no such device; EGL lists {}, counted from 0 (see virga info)", device,
                    candidates.size());
    throw Error(ErrorCode::Graphics,
                "no usable OpenGL 4.5 device for '--device {}': EGL lists {} device(s) and none gave a context; "
                "'--device cpu' draws without OpenGL",
                device, candidates.size());
}

Context::~Context()
{
    if (impl_->context == EGL_NO_CONTEXT) return;
    // Making none current would take it from another context of this thread.
    if (currentContext == this) currentContext = nullptr;
    if (currentContext == nullptr)
        destroyContext(impl_->display, impl_->context);
    else
        eglDestroyContext(impl_->display, impl_->context);
}

bool Context::tryMakeCurrent() const noexcept
{
    if (currentContext == this) return true;
    if (!eglBindAPI(EGL_OPENGL_API) || !eglMakeCurrent(impl_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, impl_->context))
        return false;
    currentContext = this;
    return true;
}

void Context::makeCurrent() const
{
    if (!tryMakeCurrent())
        throw Error(ErrorCode::Graphics, "the OpenGL context of {} is lost (EGL error 0x{:x})", impl_->device.renderer,
                    eglGetError());
}

const Context* Context::current() noexcept { return currentContext; }

const DeviceInfo& Context::device() const { return impl_->device; }

void Context::check(const char* where) const
{
    const GLenum error = glGetError();
    if (error == GL_NO_ERROR) return;
    const char* name = error == GL_OUT_OF_MEMORY       ? "out of memory"
                       : error == GL_INVALID_VALUE     ? "invalid value"
                       : error == GL_INVALID_OPERATION ? "invalid operation"
                       : error == GL_INVALID_ENUM      ? "invalid enum"
                                                       : "GL error";
    throw Error(ErrorCode::Graphics, "{}: {} (0x{:x}) on {}", where, name, error, impl_->device.renderer);
}

std::vector<DeviceInfo> listDevices()
{
    std::vector<DeviceInfo> devices;
    for (const Candidate& candidate : findCandidates()) {
        EGLContext context = makeContext(candidate.display);
        if (context == EGL_NO_CONTEXT) continue;
        devices.push_back(describe(candidate));
        destroyContext(candidate.display, context);
    }
    return devices;
}

}  // namespace virga::gl
