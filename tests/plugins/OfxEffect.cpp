// The host's side of one effect: its actions, its clips' images, its parameters' values.
#include "OfxHostInside.h"

namespace virga::test {

using namespace inside;

namespace inside {
thread_local ActionState state;
}

HostEffect::HostEffect(OfxHostOfTests& host, OfxPlugin& plugin, std::string context)
    : host_(host), plugin_(plugin), context_(std::move(context))
{
    bear(this);
}

HostEffect::~HostEffect()
{
    if (isInstance_) destroy();
    for (const auto& clip : clips_) bury(clip.second.get());
    bury(this);
}

OfxStatus HostEffect::act(const char* name, PropertySet* in, PropertySet* out)
{
    HostEffect* const before = acting;
    acting = this;
    action = name;
    OfxStatus status = ofx::statFailed;
    try {
        status = plugin_.mainEntry(name, static_cast<const void*>(this), in != nullptr ? in->handle() : nullptr,
                                   out != nullptr ? out->handle() : nullptr);
    } catch (...) {
        misuse("an exception came out of the plug-in");
    }
    if (!state.images.empty()) misuse(std::to_string(state.images.size()) + " images were not released");
    if (state.output && !state.outputIsReleased) misuse("the output was not released");
    state.images.clear();
    acting = before;
    action.clear();
    return status;
}

OfxStatus HostEffect::describe()
{
    if (!host_.kind().isPoor) description_.put(ofx::prop::type, {std::string(ofx::value::typeEffect)});
    const OfxStatus status = act(ofx::action::describe);
    if (status != ofx::statOk) return status;
    PropertySet in("in describe in context");
    in.put(ofx::prop::context, {context_});
    return act(ofx::action::describeInContext, &in);
}

void HostEffect::makeInstance(HostClip& clip) const
{
    clip.properties = std::make_unique<PropertySet>("clip");
    PropertySet& set = *clip.properties;
    set.put(ofx::prop::connected, {clip.isConnected ? 1 : 0});
    set.put(ofx::prop::pixelDepth, {clip.isConnected ? clip.depth : std::string(ofx::value::depthNone)});
    set.put(ofx::prop::components, {clip.components});
    set.put(ofx::prop::preMultiplication, {clip.alpha});
    set.put(ofx::prop::pixelAspect, {clip.aspect});
    set.put(ofx::prop::frameRate, {clip.fps});
    set.put(ofx::prop::frameRange, {clip.first, clip.last});
    if (!clip.colourspace.empty()) set.put(ofx::prop::clipColourspace, {clip.colourspace});
}

OfxStatus HostEffect::create()
{
    for (const auto& [name, clip] : clips_) makeInstance(*clip);
    instance_.put(ofx::prop::context, {context_});
    instance_.put(ofx::prop::instanceData, {static_cast<void*>(nullptr)});
    const HostClip& source = *clips_.at(ofx::value::clipSource);
    if (!host_.kind().isPoor) {
        instance_.put(ofx::prop::projectSize,
                      {source.region.x2 - source.region.x1, source.region.y2 - source.region.y1});
        instance_.put(ofx::prop::projectOffset, {source.region.x1, source.region.y1});
        instance_.put(ofx::prop::frameRate, {source.fps});
    }
    for (const auto& [name, parameter] : parameters_) {
        if (parameter->kind == ofx::value::paramString) {
            if (!texts_.contains(name)) texts_[name] = parameter->text(ofx::prop::defaultValue);
            continue;
        }
        if (numbers_.contains(name)) continue;
        auto& values = numbers_[name] = {0, 0, 0};
        for (std::size_t i = 0; i < parameter->count(ofx::prop::defaultValue); ++i)
            values[i] = parameter->number(ofx::prop::defaultValue, i);
    }
    isInstance_ = true;
    const OfxStatus status = act(ofx::action::createInstance);
    isInstance_ = status == ofx::statOk;
    return status;
}

OfxStatus HostEffect::destroy()
{
    const OfxStatus status = act(ofx::action::destroyInstance);
    isInstance_ = false;
    return status;
}

void HostEffect::set(const std::string& name, double value)
{
    if (!parameters_.contains(name)) throw std::out_of_range(name);
    numbers_[name].resize(3);
    numbers_[name][0] = value;
}

void HostEffect::set(const std::string& name, const std::string& value)
{
    if (!parameters_.contains(name)) throw std::out_of_range(name);
    texts_[name] = value;
}

double HostEffect::valueOf(const std::string& name, double time, std::size_t index) const
{
    const auto curve = curves_.find(name);
    return curve != curves_.end() && index == 0 ? curve->second(time) : numbers_.at(name)[index];
}

void HostEffect::giveValue(const std::string& name, const std::string& type, double time, va_list to)
{
    if (type == ofx::value::paramString) {
        *va_arg(to, char**) = texts_.at(name).data();
    } else if (type == ofx::value::paramDouble || type == ofx::value::paramDouble2D || type == ofx::value::paramRgb) {
        const std::size_t count = type == ofx::value::paramDouble ? 1 : type == ofx::value::paramRgb ? 3 : 2;
        for (std::size_t i = 0; i < count; ++i) *va_arg(to, double*) = valueOf(name, time, i);
    } else {
        *va_arg(to, int*) = int(valueOf(name, time));
    }
}

void HostEffect::layImage(HostImage& image, const HostClip& clip, double time, const OfxRectD* region) const
{
    const auto pixels = [&](const OfxRectD& r) {
        return OfxRectI{
            int(std::floor(r.x1 * state.scale / clip.aspect + 1e-6)), int(std::floor(r.y1 * state.scale + 1e-6)),
            int(std::ceil(r.x2 * state.scale / clip.aspect - 1e-6)), int(std::ceil(r.y2 * state.scale - 1e-6))};
    };
    const OfxRectI all = pixels(clip.region);
    OfxRectI where = region != nullptr ? pixels(*region) : all;
    where = {std::max(where.x1, all.x1), std::max(where.y1, all.y1), std::min(where.x2, all.x2),
             std::min(where.y2, all.y2)};
    image.lay(clip, where);
    const ImageF full = clip.frame(time);
    const double step = 1 / state.scale;
    for (int y = where.y1; y < where.y2; ++y)
        for (int x = where.x1; x < where.x2; ++x)
            for (int c = 0; c < image.channels; ++c) {
                // The box of pixels that this one stands for.
                const int left = int((x - all.x1) * step), top = int((all.y2 - 1 - y) * step),
                          n = std::max(int(step), 1);
                double sum = 0;
                for (int j = 0; j < n; ++j)
                    for (int i = 0; i < n; ++i)
                        sum += double(
                            full.at(std::min(left + i, full.width() - 1), std::min(top + j, full.height() - 1), c));
                image.write(x, y, c, float(sum / (n * n)));
            }
}

HostEffect::Rendered HostEffect::render(double time, const OfxRectI& window, double scale)
{
    state.time = time;
    state.scale = scale;
    state.window = window;
    state.output.reset();
    state.outputIsReleased = false;
    PropertySet in("in render");
    in.put(ofx::prop::time, {time});
    in.put(ofx::prop::renderWindow, {window.x1, window.y1, window.x2, window.y2});
    in.put(ofx::prop::renderScale, {scale, scale});
    if (!host_.kind().isPoor) in.put(ofx::prop::fieldToRender, {std::string(ofx::value::fieldNone)});
    Rendered made{act(ofx::action::render, &in), {}};
    if (!state.output) return made;
    made.pixels = ImageF(window.x2 - window.x1, window.y2 - window.y1, 4);
    for (int y = window.y1; y < window.y2; ++y)
        for (int x = window.x1; x < window.x2; ++x)
            for (int c = 0; c < 4; ++c)
                made.pixels.at(x - window.x1, window.y2 - 1 - y, c) =
                    c < state.output->channels ? state.output->read(x, y, c) : 1;
    // Nothing is written between the rows' ends and the next ones.
    const HostClip& clip = *clips_.at(ofx::value::clipOutput);
    const std::size_t row = std::size_t(std::abs(state.output->rowBytes));
    for (std::size_t end = row; row > 0 && end <= state.output->memory.size(); end += row)
        for (int i = 1; i <= clip.spareBytes; ++i)
            if (state.output->memory[end - std::size_t(i)] != std::byte(0xa5))
                misuse("bytes beyond the row were written");
    return made;
}

bool HostEffect::isIdentity(double time, std::string* clip)
{
    state.time = time;
    PropertySet in("in render"), out("out identity");
    in.put(ofx::prop::time, {time});
    in.put(ofx::prop::renderScale, {1.0, 1.0});
    const bool isIdentity = act(ofx::action::isIdentity, &in, &out) == ofx::statOk;
    if (clip != nullptr) *clip = out.text(ofx::prop::name);
    return isIdentity;
}

std::map<std::string, OfxRectD> HostEffect::regionsOfInterest(double time, const OfxRectD& region, double scale)
{
    state.time = time;
    PropertySet in("in regions"), out("out regions");
    in.put(ofx::prop::time, {time});
    in.put(ofx::prop::renderScale, {scale, scale});
    in.put(ofx::prop::regionOfInterest, {region.x1, region.y1, region.x2, region.y2});
    act(ofx::action::getRegionsOfInterest, &in, &out);
    std::map<std::string, OfxRectD> regions;
    for (const auto& [name, clip] : clips_) {
        const std::string property = ofx::prop::clipRegionOfInterest + name;
        if (out.count(property) == 4)
            regions[name] = {out.number(property, 0), out.number(property, 1), out.number(property, 2),
                             out.number(property, 3)};
    }
    return regions;
}

std::vector<std::pair<double, double>> HostEffect::framesNeeded(double time)
{
    state.time = time;
    PropertySet in("in regions"), out("out frames");
    in.put(ofx::prop::time, {time});
    act(ofx::action::getFramesNeeded, &in, &out);
    std::vector<std::pair<double, double>> ranges;
    const std::string property = std::string(ofx::prop::clipFrameRange) + ofx::value::clipSource;
    for (std::size_t i = 0; i + 1 < out.count(property); i += 2)
        ranges.emplace_back(out.number(property, i), out.number(property, i + 1));
    return ranges;
}

}  // namespace virga::test
