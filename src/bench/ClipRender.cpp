#include "bench/ClipRender.h"

#include <vector>

#include "bench/PlainRain.h"
#include "shot/Compositor.h"

namespace virga::bench {

ImageF layerOf(const io::RenderedFrame& frame, const std::string& name)
{
    for (const io::Layer& layer : frame.layers)
        if (layer.name == name && layer.channels.size() == 4) return layer.pixels;
    return ImageF(frame.beauty.width(), frame.beauty.height(), 4);
}

Measured measuredOf(const io::RenderedFrame& frame)
{
    Measured measured{.beauty = frame.beauty, .effect = frame.beauty};
    const ImageF plate = layerOf(frame, "plate");
    for (std::size_t i = 0; i < plate.size(); ++i) measured.effect.data()[i] -= plate.data()[i];
    return measured;
}

Measured renderClip(const Clip& clip, const shot::Settings& settings)
{
    shot::Compositor compositor(settings, clip.shot, {.wanted = {.layers = true}, .device = "cpu", .shaderFolder = {}},
                                {});
    Measured measured = measuredOf(compositor.render(clip.frame));
    std::vector<double> ms;
    for (int i = 0; i < 5; ++i) {
        const double before = compositor.statistics().renderSeconds;
        compositor.render(clip.frame);
        ms.push_back(1e3 * (compositor.statistics().renderSeconds - before));
    }
    measured.ms = medianOf(ms);
    measured.lightOrder = compositor.statistics().lightOrder;
    return measured;
}

Measured renderTruth(const Clip& clip, const shot::Settings& settings, const shot::ReferenceOptions& options)
{
    shot::ReferenceRenderer reference(settings, clip.shot, {.layers = true}, {}, options);
    Measured measured = measuredOf(reference.render(clip.frame));
    measured.ms = 1e3 * reference.statistics().renderSeconds;
    return measured;
}

}  // namespace virga::bench
