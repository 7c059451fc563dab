// What KeptFiles would find in files, at hand for everything that one thread does while it lives: the light of a
// panorama that a second shot asks for.
#pragma once

#include <cstddef>
#include <list>
#include <optional>
#include <string>
#include <string_view>

namespace virga {

/// One at a time on a thread; KeptFiles of that thread, those without a folder too, look here first. Content that was
/// not asked for the longest goes first.
class KeptInMemory {
public:
    static constexpr std::size_t standardBytes = std::size_t(64) << 20;

    explicit KeptInMemory(std::size_t mostBytes = standardBytes);
    ~KeptInMemory();
    KeptInMemory(const KeptInMemory&) = delete;
    KeptInMemory& operator=(const KeptInMemory&) = delete;

    /// Of this thread, or null.
    static KeptInMemory* ofThread() noexcept;

    std::optional<std::string> load(std::string_view kind, std::string_view key);
    /// Nothing happens if it alone is more than there is room for.
    void store(std::string_view kind, std::string_view key, std::string_view content);
    std::size_t bytes() const { return bytes_; }

private:
    struct Entry {
        std::string kind, key, content;
        std::size_t bytes() const { return kind.size() + key.size() + content.size(); }
    };
    std::list<Entry>::iterator find(std::string_view kind, std::string_view key);

    std::list<Entry> entries_;  // asked for last first; a few dozen, searched from the front
    std::size_t bytes_ = 0, mostBytes_;
};

}  // namespace virga
