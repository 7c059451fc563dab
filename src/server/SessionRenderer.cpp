#include "server/SessionRenderer.h"

#include <algorithm>
#include <cmath>

#include "core/Error.h"
#include "core/Log.h"

namespace virga::server {
namespace {

/// Nothing outside the window.
void blankOutside(ImageF& pixels, const Window& window)
{
    for (int y = 0; y < pixels.height(); ++y)
        for (int x = 0; x < pixels.width(); ++x)
            if (!window.contains({x, y, 1, 1})) std::fill_n(pixels.pixel(x, y), pixels.channels(), 0.0f);
}

/// The plate as the compositor is to have it for a view, which gets to know what of it is given: the frame, and around
/// it what the region reaches for, out of an EXR's overscan where there is one.
io::PlateFrame plateOf(const RenderTask& task, shot::View& view)
{
    io::PlateFrame plate = *task.plate;
    plate.number = task.query.frame;
    if (!task.query.dataWindow.isEmpty()) {
        blankOutside(plate.pixels, task.query.dataWindow);
        plate.content = 0;
    }
    if (view.scale == 1 && view.region.isEmpty()) return plate;
    plate.content = 0;  // the pixels are others than those of the plate's frame
    Window given{0, 0, plate.pixels.width(), plate.pixels.height()};
    if (view.scale != 1) {
        plate.pixels = shot::proxyOf(plate.pixels, view.scale);
        given = {0, 0, plate.pixels.width(), plate.pixels.height()};
    } else if (!given.contains(view.region) && task.query.dataWindow.isEmpty()) {
        const int x = std::max({0, -view.region.x, view.region.right() - given.width});
        const int y = std::max({0, -view.region.y, view.region.bottom() - given.height});
        plate.pixels = io::withOverscan(plate, x, y);
        given = {-x, -y, given.width + 2 * x, given.height + 2 * y};
    }
    view.plate = united(given, view.region.isEmpty() ? given : view.region);
    plate.pixels = shot::placed(std::move(plate.pixels), given, view.plate);
    return plate;
}

}  // namespace

std::string RenderDevice::wanted() const
{
    const std::lock_guard lock(mutex_);
    return fallback_.empty() ? wanted_ : "cpu";
}
std::string RenderDevice::used() const
{
    const std::lock_guard lock(mutex_);
    return used_;
}
std::string RenderDevice::fallback() const
{
    const std::lock_guard lock(mutex_);
    return fallback_;
}

void RenderDevice::note(const std::string& used)
{
    if (used.empty()) return;
    {
        const std::lock_guard lock(mutex_);
        if (used_ == used) return;
        used_ = used;
    }
    log::info("rendering on {}", used);
}

void RenderDevice::fallBack(const std::string& why)
{
    {
        const std::lock_guard lock(mutex_);
        fallback_ = why;
    }
    log::warning("the processor renders from now on: {}", firstLine(why));
}

SessionRenderer::SessionRenderer(RenderDevice& device, std::string cacheFolder)
    : device_(device), cacheFolder_(std::move(cacheFolder))
{
}

shot::Compositor& SessionRenderer::compositorFor(const RenderTask& task, bool layers)
{
    Slot& slot = slots_[layers ? 1 : 0];
    if (slot.compositor && slot.inputsKey == task.inputs->key) {
        if (slot.settingsKey != task.settingsKey) {
            slot.settingsKey.clear();
            slot.compositor->change(task.settings);
            slot.settingsKey = task.settingsKey;
        }
        return *slot.compositor;
    }
    slot = {};
    shot::CompositorOptions options;
    options.wanted.layers = layers;
    options.device = device_.wanted();
    options.changes = true;
    options.cacheFolder = cacheFolder_;
    slot.compositor =
        std::make_unique<shot::Compositor>(task.settings, task.inputs->shot, options, task.inputs->samples);
    slot.inputsKey = task.inputs->key;
    slot.settingsKey = task.settingsKey;
    return *slot.compositor;
}

Picture SessionRenderer::renderOnce(const RenderTask& task, const Watch& watch, std::map<std::string, double>& passMs)
{
    shot::Compositor& compositor = compositorFor(task, task.query.wantsLayers());
    shot::View view = task.query.view;
    const shot::Shot& shot = task.inputs->shot;
    io::PlateFrame plate = plateOf(task, view);
    Picture picture;
    const Window frame = shot::frameAt(shot.width, shot.height, view.scale);
    picture.frameWidth = frame.width;
    picture.frameHeight = frame.height;
    picture.data = view.region.isEmpty() ? frame : view.region;
    const std::map<std::string, double> before = compositor.statistics().passMs;
    picture.frame = compositor.render(std::move(plate), view, watch);
    if (picture.frame.beauty.width() != picture.data.width || picture.frame.beauty.height() != picture.data.height)
        throw Error(ErrorCode::Internal, "frame {}: {}x{} pixels were rendered where {}x{} were asked for",
                    task.query.frame, picture.frame.beauty.width(), picture.frame.beauty.height(), picture.data.width,
                    picture.data.height);
    for (const auto& [pass, ms] : compositor.statistics().passMs) {
        const auto found = before.find(pass);
        passMs[pass] = ms - (found != before.end() ? found->second : 0);
    }
    device_.note(compositor.statistics().device);
    return picture;
}

Picture SessionRenderer::render(const RenderTask& task, const Watch& watch, std::map<std::string, double>& passMs)
{
    try {
        return renderOnce(task, watch, passMs);
    } catch (const Error& error) {
        if (error.code() != ErrorCode::Graphics) {
            // A frame that fails, for whatever reason, leaves nothing behind for the next one.
            if (error.code() != ErrorCode::Interrupted) slots_[task.query.wantsLayers() ? 1 : 0] = {};
            throw;
        }
        slots_ = {};
        if (device_.wanted() == "cpu") throw;
        device_.fallBack(error.what());
    }
    return renderOnce(task, watch, passMs);
}

}  // namespace virga::server
