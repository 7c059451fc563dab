// Files that appear under their name only when they are whole.
#pragma once

#include <string>

namespace virga::io {

/// The file of `finalPath` while it is being made: for out.mp4 `.out.partial.mp4` in the same folder, so that renaming is
/// atomic and that players know what they open if the program is killed. Unless commit() is called the destructor
/// removes it.
class AtomicFile {
public:
    /// `mark`: the word in the temporary name, where one output needs several files.
    explicit AtomicFile(std::string finalPath, const char* mark = "partial");
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    const std::string& finalPath() const { return finalPath_; }
    const std::string& temporaryPath() const { return temporaryPath_; }

    /// Gives the file its name, replacing what had it. Throws Error(Output).
    void commit();

private:
    std::string finalPath_, temporaryPath_;
    bool committed_ = false;
};

/// Throws Error(Output) unless the folder of `path` exists and can be written to, and `path` is not a folder itself.
void checkOutputFolder(const std::string& path);

/// Whether both names mean the same file; false if either does not exist.
bool isSameFile(const std::string& a, const std::string& b) noexcept;

}  // namespace virga::io
