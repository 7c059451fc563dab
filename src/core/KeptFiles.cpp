#include "core/KeptFiles.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <tuple>
#include <vector>

#include "core/KeptInMemory.h"

namespace virga {
namespace {

namespace fs = std::filesystem;

/// At the head of each file. Another layout, or what is kept meaning something else, is another version.
constexpr char magic[8] = {'v', 'i', 'r', 'g', 'a', ' ', '0', '1'};

struct Head {
    char magic[8];
    std::uint64_t keyBytes, contentBytes, check;
};

std::uint64_t mixed(std::uint64_t x)
{
    x ^= x >> 32;
    x *= 0xd6e8feb86659fd93u;
    x ^= x >> 32;
    return x;
}

std::string environmentVariable(const char* name)
{
    const char* value = std::getenv(name);
    return value != nullptr ? value : "";
}

}  // namespace

std::uint64_t contentHash(std::string_view bytes) noexcept
{
    std::uint64_t hash = mixed(bytes.size() + 0x9e3779b97f4a7c15u);
    for (std::size_t at = 0; at < bytes.size(); at += 8) {
        std::uint64_t word = 0;
        std::memcpy(&word, bytes.data() + at, std::min<std::size_t>(8, bytes.size() - at));
        hash = mixed(hash * 0x100000001b3u ^ word);
    }
    return hash;
}

std::string keptFilesFolder()
{
    const std::string cache = environmentVariable("XDG_CACHE_HOME"), home = environmentVariable("HOME");
    if (cache.starts_with('/')) return cache + "/virga";
    return home.starts_with('/') ? home + "/.cache/virga" : "";
}

KeptFiles::KeptFiles(std::string folder, std::uintmax_t mostBytes) : folder_(std::move(folder)), mostBytes_(mostBytes)
{
}

std::string KeptFiles::pathOf(std::string_view kind, std::string_view key) const
{
    return fmt::format("{}/{}-{:016x}.kept", folder_, kind, contentHash(key));
}

std::optional<std::string> KeptFiles::load(std::string_view kind, std::string_view key) const noexcept
try {
    KeptInMemory* const memory = KeptInMemory::ofThread();
    if (memory != nullptr)
        if (std::optional<std::string> content = memory->load(kind, key)) return content;
    if (folder_.empty()) return std::nullopt;
    const std::string path = pathOf(kind, key);
    std::ifstream file(path, std::ios::binary);
    if (!file) return std::nullopt;
    const std::string all((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    Head head{};
    if (all.size() < sizeof head) return std::nullopt;
    std::memcpy(&head, all.data(), sizeof head);
    if (std::memcmp(head.magic, magic, sizeof magic) != 0 || head.keyBytes != key.size() ||
        all.size() - sizeof head < key.size() || head.contentBytes != all.size() - sizeof head - key.size())
        return std::nullopt;
    const std::string_view rest = std::string_view(all).substr(sizeof head);
    if (rest.substr(0, key.size()) != key || contentHash(rest) != head.check) return std::nullopt;
    utimensat(AT_FDCWD, path.c_str(), nullptr, 0);  // asked for just now
    std::string content(rest.substr(key.size()));
    if (memory != nullptr) memory->store(kind, key, content);
    return content;
} catch (...) {
    return std::nullopt;
}

void KeptFiles::store(std::string_view kind, std::string_view key, std::string_view content) const noexcept
try {
    if (KeptInMemory* const memory = KeptInMemory::ofThread()) memory->store(kind, key, content);
    if (folder_.empty() || content.size() + key.size() > mostBytes_ / 2) return;
    std::error_code failure;
    fs::create_directories(folder_, failure);
    if (failure) return;
    static std::atomic<unsigned> number = 0;  // names alone: two threads never write into one file
    const std::string path = pathOf(kind, key);
    const std::string temporary = fmt::format("{}.{}-{}.partial", path, getpid(), ++number);
    const std::string rest = std::string(key).append(content);
    Head head{{}, key.size(), content.size(), contentHash(rest)};
    std::memcpy(head.magic, magic, sizeof magic);
    {
        std::ofstream file(temporary, std::ios::binary);
        file.write(reinterpret_cast<const char*>(&head), sizeof head);
        file.write(rest.data(), std::streamsize(rest.size()));
        file.close();
        if (file) fs::rename(temporary, path, failure);
        if (!file || failure) fs::remove(temporary, failure);
    }
    makeRoom();
} catch (...) {  // NOLINT(bugprone-empty-catch): what cannot be kept is worked out again
}

/// Also takes away what killed runs left half written, an hour later.
void KeptFiles::makeRoom() const
{
    using Entry = std::tuple<fs::file_time_type, std::uintmax_t, fs::path>;
    std::vector<Entry> entries;
    std::uintmax_t all = 0;
    const auto hourAgo = fs::file_time_type::clock::now() - std::chrono::hours(1);
    for (const fs::directory_entry& file : fs::directory_iterator(folder_)) {
        std::error_code gone;
        const auto time = file.last_write_time(gone);
        const std::uintmax_t bytes = gone ? 0 : file.file_size(gone);
        if (gone) continue;
        if (file.path().extension() == ".partial" && time < hourAgo) fs::remove(file.path(), gone);
        if (file.path().extension() != ".kept") continue;
        entries.emplace_back(time, bytes, file.path());
        all += bytes;
    }
    std::sort(entries.begin(), entries.end());
    for (const auto& [time, bytes, path] : entries) {
        if (all <= mostBytes_) return;
        std::error_code gone;
        fs::remove(path, gone);
        all -= bytes;
    }
}

}  // namespace virga
