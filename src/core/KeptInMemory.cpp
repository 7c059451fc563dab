#include "core/KeptInMemory.h"

#include <algorithm>
#include <cassert>

namespace virga {
namespace {

thread_local KeptInMemory* kept = nullptr;

}  // namespace

KeptInMemory::KeptInMemory(std::size_t mostBytes) : mostBytes_(mostBytes)
{
    assert(kept == nullptr);
    kept = this;
}

KeptInMemory::~KeptInMemory() { kept = nullptr; }

KeptInMemory* KeptInMemory::ofThread() noexcept { return kept; }

std::list<KeptInMemory::Entry>::iterator KeptInMemory::find(std::string_view kind, std::string_view key)
{
    return std::find_if(entries_.begin(), entries_.end(),
                        [&](const Entry& entry) { return entry.kind == kind && entry.key == key; });
}

std::optional<std::string> KeptInMemory::load(std::string_view kind, std::string_view key)
{
    const auto found = find(kind, key);
    if (found == entries_.end()) return std::nullopt;
    entries_.splice(entries_.begin(), entries_, found);
    return found->content;
}

void KeptInMemory::store(std::string_view kind, std::string_view key, std::string_view content)
{
    if (const auto found = find(kind, key); found != entries_.end()) {
        bytes_ -= found->bytes();
        entries_.erase(found);
    }
    Entry entry{std::string(kind), std::string(key), std::string(content)};
    if (entry.bytes() > mostBytes_) return;
    bytes_ += entry.bytes();
    entries_.push_front(std::move(entry));
    while (bytes_ > mostBytes_) {
        bytes_ -= entries_.back().bytes();
        entries_.pop_back();
    }
}

}  // namespace virga
