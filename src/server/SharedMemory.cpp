#include "server/SharedMemory.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>

#include "core/Error.h"

namespace virga::server {
namespace {

namespace fs = std::filesystem;
constexpr const char* folder = "/dev/shm";

/// When the process began [ticks since the machine did]; empty if there is no such process. proc(5), field 22.
std::string birthOf(long pid)
{
    std::ifstream file(fmt::format("/proc/{}/stat", pid));
    std::string text;
    if (!std::getline(file, text)) return {};
    std::istringstream rest(text.substr(text.rfind(')') + 1));  // the name before it may hold anything
    std::string word;
    for (int field = 3; field <= 22; ++field) rest >> word;
    return word;
}

}  // namespace

std::string sharedPath(const std::string& name) { return std::string(folder) + "/" + name; }

std::string newSharedName()
{
    static std::atomic<unsigned> count = 0;
    static const std::string birth = birthOf(getpid());
    return fmt::format("virga-{}-{}-{}", getpid(), birth, count++);
}

void sweepSharedMemory() noexcept
try {
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
        const std::string name = entry.path().filename().string();
        long pid = 0;
        unsigned long long birth = 0;
        unsigned number = 0;
        if (std::sscanf(name.c_str(), "virga-%ld-%llu-%u", &pid, &birth, &number) != 3) continue;
        struct stat status {};
        if (lstat(entry.path().c_str(), &status) != 0 || status.st_uid != geteuid()) continue;
        if (birthOf(pid) != std::to_string(birth)) fs::remove_all(entry.path(), error);
    }
} catch (const std::exception&) {
    // What is left there costs memory and hinders nobody.
}

ScratchFile::ScratchFile(const std::string& ending) : path_(sharedPath(newSharedName()) + ending) {}
ScratchFile::~ScratchFile() { unlink(path_.c_str()); }

std::string ScratchFile::content() const
{
    const int file = open(path_.c_str(), O_RDONLY | O_CLOEXEC);
    struct stat status {};
    std::string bytes;
    bool isRead = file >= 0 && fstat(file, &status) == 0;
    if (isRead) {
        bytes.resize(std::size_t(status.st_size));
        isRead = read(file, bytes.data(), bytes.size()) == ssize_t(bytes.size());
    }
    if (file >= 0) close(file);
    if (!isRead) throw Error(ErrorCode::Output, "{}: cannot be read again ({})", path_, std::strerror(errno));
    return bytes;
}

ScratchFolder::ScratchFolder() : path_(sharedPath(newSharedName()))
{
    if (mkdir(path_.c_str(), 0700) != 0)
        throw Error(ErrorCode::Output, "{}: cannot be made ({})", path_, std::strerror(errno));
}

ScratchFolder::~ScratchFolder()
{
    std::error_code error;
    fs::remove_all(path_, error);
}

SharedBlock::SharedBlock(std::size_t bytes) : name_(newSharedName()), bytes_(bytes)
{
    const int file = open(sharedPath(name_).c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
    int problem = file < 0 ? errno : posix_fallocate(file, 0, off_t(bytes));
    if (problem == 0) {
        void* const mapped = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, file, 0);
        if (mapped == MAP_FAILED)
            problem = errno;
        else
            data_ = static_cast<std::byte*>(mapped);
    }
    if (file >= 0) close(file);
    if (problem != 0) {
        unlink(sharedPath(name_).c_str());
        throw Error(ErrorCode::Output, "shared memory: no room for {} bytes in {} ({})", bytes, folder,
                    std::strerror(problem));
    }
}

SharedBlock::~SharedBlock()
{
    munmap(data_, bytes_);
    if (!isKept_) unlink(sharedPath(name_).c_str());
}

SharedShelf::~SharedShelf()
{
    while (!kept_.empty()) drop(kept_.begin());
}

void SharedShelf::drop(std::deque<Kept>::iterator which)
{
    unlink(sharedPath(which->name).c_str());
    bytes_ -= which->bytes;
    kept_.erase(which);
}

void SharedShelf::keep(SharedBlock& block)
{
    const std::lock_guard lock(mutex_);
    kept_.push_back({block.name(), block.bytes(), std::chrono::steady_clock::now() + time_});
    bytes_ += block.bytes();
    block.isKept_ = true;
    while (bytes_ > mostBytes_ && kept_.size() > 1) drop(kept_.begin());
}

bool SharedShelf::release(const std::string& name)
{
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const Kept& kept) { return kept.name == name; });
    if (found == kept_.end()) return false;
    drop(found);
    return true;
}

void SharedShelf::sweep()
{
    const std::lock_guard lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    while (!kept_.empty() && kept_.front().until < now) drop(kept_.begin());
}

std::size_t SharedShelf::bytes() const
{
    const std::lock_guard lock(mutex_);
    return bytes_;
}

}  // namespace virga::server
