// Memory below /dev/shm that the server shares with clients of the same machine: frames without a copy through a
// socket, and files on their way through libraries that know paths alone.
//
// Names say who made them: virga-PID-BIRTH-N, the process by its number and when it began, in the kernel's ticks, so
// that a later process of the same number is not taken for it. What a killed server left is removed by the next one.
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <mutex>
#include <string>

namespace virga::server {

/// Removes what dead servers of this user left.
void sweepSharedMemory() noexcept;

/// A new name of this process, without its folder.
std::string newSharedName();
/// "/dev/shm/NAME".
std::string sharedPath(const std::string& name);

/// A file of this process that goes with this object.
class ScratchFile {
public:
    explicit ScratchFile(const std::string& ending);
    ~ScratchFile();
    ScratchFile(const ScratchFile&) = delete;
    ScratchFile& operator=(const ScratchFile&) = delete;
    const std::string& path() const { return path_; }
    std::string content() const;  ///< throws Error(Output)

private:
    std::string path_;
};

/// A folder of this process that goes, with all in it, with this object.
class ScratchFolder {
public:
    ScratchFolder();  ///< throws Error(Output)
    ~ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;
    const std::string& path() const { return path_; }

private:
    std::string path_;
};

/// Memory that is being filled.
class SharedBlock {
public:
    /// Throws Error(Output) with the number of bytes where there is no room. (All of it is allocated here: a page that
    /// cannot be had later would end the program.)
    explicit SharedBlock(std::size_t bytes);
    ~SharedBlock();
    SharedBlock(const SharedBlock&) = delete;
    SharedBlock& operator=(const SharedBlock&) = delete;
    const std::string& name() const { return name_; }
    std::byte* data() const { return data_; }
    std::size_t bytes() const { return bytes_; }

private:
    friend class SharedShelf;
    std::string name_;
    std::byte* data_ = nullptr;
    std::size_t bytes_ = 0;
    bool isKept_ = false;
};

/// Blocks that were handed out. Each stays under its name until the client says that it has it, until so many seconds
/// have passed, or until newer ones need its room; whoever has mapped it keeps it anyway.
class SharedShelf {
public:
    SharedShelf(std::size_t mostBytes, std::chrono::seconds time) : mostBytes_(mostBytes), time_(time) {}
    ~SharedShelf();
    void keep(SharedBlock& block);
    bool release(const std::string& name);  ///< false if there is none
    void sweep();                           ///< those whose time is over
    std::size_t bytes() const;

private:
    struct Kept {
        std::string name;
        std::size_t bytes;
        std::chrono::steady_clock::time_point until;
    };
    void drop(std::deque<Kept>::iterator which);

    const std::size_t mostBytes_;
    const std::chrono::seconds time_;
    mutable std::mutex mutex_;
    std::deque<Kept> kept_;  // oldest first
    std::size_t bytes_ = 0;
};

}  // namespace virga::server
