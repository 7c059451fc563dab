#include "shot/OverscanRenderer.h"

#include <utility>

namespace virga::shot {

OverscanRenderer::OverscanRenderer(const Settings& settings, const Shot& shot, const Margins& margins,
                                   const CompositorOptions& options, const PlateSamples& samples)
    : margins_(margins)
{
    view_.region = {-margins.x, -margins.y, shot.width + 2 * margins.x, shot.height + 2 * margins.y};
    run([&] { compositor_ = std::make_unique<Compositor>(settings, shot, options, samples); });
    wait();
}

OverscanRenderer::~OverscanRenderer()
{
    run([this] { compositor_.reset(); });
    queue_.drain();
}

void OverscanRenderer::begin(const io::PlateFrame& frame)
{
    auto wide = std::make_shared<io::PlateFrame>();
    wide->number = frame.number;
    wide->time_s = frame.time_s;
    wide->pixels = io::withOverscan(frame, margins_.x, margins_.y);
    run([this, wide] { result_ = compositor_->render(std::move(*wide), view_, {}).beauty; });
}

ImageF OverscanRenderer::finish()
{
    wait();
    return std::move(result_);
}

void OverscanRenderer::run(std::function<void()> job)
{
    queue_.push([this, job = std::move(job)] {
        try {
            job();
        } catch (...) {
            problem_ = std::current_exception();  // the queue would do nothing any more
        }
    });
}

void OverscanRenderer::wait()
{
    queue_.drain();
    if (problem_) std::rethrow_exception(std::exchange(problem_, nullptr));
}

}  // namespace virga::shot
