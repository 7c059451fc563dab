// What was worked out once, kept in files for the next run of the program: compiled shaders, the light of a panorama.
// A convenience and never more: what is not there, damaged, of another version or cannot be written is worked out
// again, and nothing is said.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace virga {

class KeptFiles {
public:
    static constexpr std::uintmax_t standardBytes = std::uintmax_t(256) << 20;

    /// Keeps nothing and finds nothing, but what KeptInMemory does for this thread.
    KeptFiles() = default;
    /// folder    made when something is stored; empty: as the default
    /// mostBytes of all files together; those that were not asked for the longest go first
    explicit KeptFiles(std::string folder, std::uintmax_t mostBytes = standardBytes);

    /// What was stored under (kind, key). kind: letters, part of the file's name. key: any bytes that say all that the
    /// content depends on; they are stored with it and compared, so that two keys never share content.
    std::optional<std::string> load(std::string_view kind, std::string_view key) const noexcept;

    /// Whole or not at all, whoever else stores at the same time.
    void store(std::string_view kind, std::string_view key, std::string_view content) const noexcept;

private:
    std::string pathOf(std::string_view kind, std::string_view key) const;
    void makeRoom() const;

    std::string folder_;
    std::uintmax_t mostBytes_ = 0;
};

/// $XDG_CACHE_HOME/virga, else $HOME/.cache/virga (XDG Base Directory Specification 0.8); empty if neither is an
/// absolute path.
std::string keptFilesFolder();

/// 64 bits of a text or file that differ when it does, but for accidents; not against an adversary.
std::uint64_t contentHash(std::string_view bytes) noexcept;

}  // namespace virga
