#include "gl/SharedContexts.h"

#include <cassert>
#include <utility>

#include "core/Error.h"

namespace virga::gl {
namespace {

thread_local SharedContexts* shared = nullptr;

}  // namespace

SharedContexts::SharedContexts()
{
    assert(shared == nullptr);
    shared = this;
}

SharedContexts::~SharedContexts()
{
    shared = nullptr;
    for (const auto& [context, held] : byContext_) {
        context->tryMakeCurrent();  // else it is lost, with all that was in it
        held->programs.clear();
    }
}

SharedContexts* SharedContexts::ofThread() noexcept { return shared; }

std::shared_ptr<const Context> SharedContexts::open(const std::string& device)
{
    if (shared == nullptr) return std::make_shared<const Context>(device);
    auto context = shared->contextOf(device);
    context->makeCurrent();
    return context;
}

std::shared_ptr<const Context> SharedContexts::contextOf(const std::string& device)
{
    if (const auto found = byDevice_.find(device); found != byDevice_.end()) return found->second->context;
    if (const auto found = absent_.find(device); found != absent_.end())
        throw Error(ErrorCode::Graphics, found->second);
    try {
        auto held = std::make_shared<Held>(Held{std::make_shared<const Context>(device), {}});
        for (const auto& [word, other] : byDevice_)
            if (other->context->device().index == held->context->device().index) held = other;
        byDevice_[device] = byContext_[held->context.get()] = held;
        return held->context;
    } catch (const Error& error) {
        if (error.code() == ErrorCode::Graphics) absent_[device] = error.what();
        throw;
    }
}

std::shared_ptr<const LinkedProgram> SharedContexts::program(const std::string& key) const
{
    const auto held = byContext_.find(Context::current());
    if (held == byContext_.end()) return nullptr;
    const auto& programs = held->second->programs;
    const auto found = programs.find(key);
    return found != programs.end() ? found->second : nullptr;
}

void SharedContexts::keep(const std::string& key, std::shared_ptr<const LinkedProgram> program)
{
    const auto held = byContext_.find(Context::current());
    if (held == byContext_.end()) return;
    auto& programs = held->second->programs;
    if (programs.size() >= mostPrograms)
        std::erase_if(programs, [](const auto& p) { return p.second.use_count() == 1; });
    programs[key] = std::move(program);
}

}  // namespace virga::gl
