// What was made lately, bounded by bytes: the least lately asked for goes first.
#pragma once

#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <utility>

namespace virga::server {

/// Thread-safe. Values are shared and never change, so that one that goes stays for who holds it.
template <class Value>
class LruCache {
public:
    explicit LruCache(std::size_t mostBytes) : mostBytes_(mostBytes) {}

    /// Null if it is not there.
    std::shared_ptr<const Value> find(const std::string& key)
    {
        const std::lock_guard lock(mutex_);
        const auto found = places_.find(key);
        if (found == places_.end()) return nullptr;
        entries_.splice(entries_.begin(), entries_, found->second);
        return entries_.front().value;
    }

    /// One larger than all there is room for is not kept.
    void keep(const std::string& key, std::shared_ptr<const Value> value, std::size_t bytes)
    {
        const std::lock_guard lock(mutex_);
        if (const auto found = places_.find(key); found != places_.end()) drop(found->second);
        if (bytes > mostBytes_) return;
        entries_.push_front({key, std::move(value), bytes});
        places_[key] = entries_.begin();
        bytes_ += bytes;
        while (bytes_ > mostBytes_) drop(std::prev(entries_.end()));
    }

    std::size_t bytes() const
    {
        const std::lock_guard lock(mutex_);
        return bytes_;
    }

private:
    struct Entry {
        std::string key;
        std::shared_ptr<const Value> value;
        std::size_t bytes;
    };
    using Place = typename std::list<Entry>::iterator;

    void drop(Place place)
    {
        bytes_ -= place->bytes;
        places_.erase(place->key);
        entries_.erase(place);
    }

    const std::size_t mostBytes_;
    mutable std::mutex mutex_;
    std::list<Entry> entries_;  // latest first
    std::unordered_map<std::string, Place> places_;
    std::size_t bytes_ = 0;
};

}  // namespace virga::server
