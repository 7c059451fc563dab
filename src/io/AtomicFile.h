// Files that appear under their name only when they are whole.
//
// Until then a file lies in the same folder, so that renaming is atomic, under a hidden name of its own that keeps its
// ending, so that players know what they open if the program is killed: for out.mp4 `.out.partial-HOST-PID-N.mp4`.
// Two runs to one output never share it: it is made with O_EXCL. Its maker holds a lock (flock) on it, which ends with
// the process however that ends, so that the next run can tell what a dead one left from what a living one is making.
// Where the file system has no locks nothing is ever taken for left.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace virga::io {

/// The file of `finalPath` while it is being made. Unless commit() is called the destructor removes it.
class AtomicFile {
public:
    /// Makes the file, empty. `mark`: the word in the temporary name, where one output needs several files.
    /// Throws Error(Output).
    explicit AtomicFile(std::string finalPath, const char* mark = "partial");
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    const std::string& finalPath() const { return finalPath_; }
    /// To be opened by this name and overwritten, not replaced.
    const std::string& temporaryPath() const { return temporaryPath_; }

    /// Adds to the file. Throws Error(Output).
    void write(std::string_view bytes);

    /// Gives the file its name, replacing what had it. Throws Error(Output).
    void commit();

private:
    std::string finalPath_, temporaryPath_;
    int locked_ = -1;  // descriptor; closed once it is committed
};

/// A file in memory for libraries that write to a path, not all of which notice a full disk: a PNG, TGA, BMP or SGI is
/// cut off without a word, and libjpeg's writer ends the program. It holds one encoded picture.
class MemoryFile {
public:
    MemoryFile();
    ~MemoryFile();
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;

    /// Opens it anew, for this process, as long as this object lives.
    std::string path() const;

    /// What was written becomes the content of `file`. Throws Error(Output).
    void writeTo(AtomicFile& file) const;

private:
    int file_ = -1;
};

/// Writes `path` at once, whole or not at all. Throws Error(Output).
void writeWholeFile(const std::string& path, std::string_view content);

/// The temporary files of `path`, or if it is a frame pattern of each of its frames, that a run left which was killed;
/// sorted. Empty if the folder cannot be read.
std::vector<std::string> findLeftovers(const std::string& path);

/// Removes what findLeftovers() gave and is still nobody's.
void removeLeftovers(const std::vector<std::string>& files) noexcept;

/// Removes the leftovers of `path`, a file or a pattern, with a warning that names them: half an image is worth
/// nothing.
void sweepLeftovers(const std::string& path);

/// Throws Error(Output) unless the folder of `path` exists and can be written to, and what has that name already, if
/// anything, is a file.
void checkOutputFolder(const std::string& path);

/// Whether both names mean the same file; false if either does not exist.
bool isSameFile(const std::string& a, const std::string& b) noexcept;

}  // namespace virga::io
