#include "io/AtomicFile.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>
#include <system_error>

#include "core/Error.h"
#include "core/Log.h"
#include "io/Plate.h"

namespace virga::io {

namespace fs = std::filesystem;

namespace {

fs::path folderOf(const fs::path& path)
{
    const fs::path folder = path.parent_path();
    return folder.empty() ? fs::path(".") : folder;
}

/// Of `host` and the two numbers; a name of 255 bytes is the longest that file systems hold.
constexpr std::size_t longestHost = 40, longestTag = longestHost + 24, longestName = 255;
constexpr const char* marks[] = {"partial", "finishing"};

std::string hostName()
{
    char name[256] = "";
    gethostname(name, sizeof name - 1);
    std::string host(name, strnlen(name, std::min(sizeof name, longestHost)));
    std::replace(host.begin(), host.end(), '/', '_');
    return host.empty() ? "host" : host;
}

/// What stands before the tag in the temporary name of a file: ".out.partial-".
std::string headOf(const fs::path& finalName, const char* mark)
{
    const std::size_t others = std::strlen(mark) + 3 + longestTag + finalName.extension().native().size();
    const std::size_t most = others < longestName ? longestName - others : 1;
    return fmt::format(".{}.{}-", finalName.stem().native().substr(0, most), mark);
}

/// Whether this is "HOST-PID-N".
bool isTag(std::string_view text)
{
    for (int number = 0; number < 2; ++number) {
        const std::size_t dash = text.rfind('-');
        if (dash == std::string_view::npos || dash + 1 == text.size()) return false;
        const std::string_view digits = text.substr(dash + 1);
        if (!std::all_of(digits.begin(), digits.end(), [](unsigned char c) { return std::isdigit(c) != 0; }))
            return false;
        text.remove_suffix(text.size() - dash);
    }
    return !text.empty();
}

/// Whether `name` is a temporary name of the file `finalName`, or of a frame of it if it is a pattern.
bool isTemporaryOf(const std::string& name, const fs::path& finalName, bool isPattern)
{
    const std::string ending = finalName.extension().native();
    for (const char* mark : marks) {
        const std::string head = isPattern ? fmt::format(".{}-", mark) : headOf(finalName, mark);
        const std::size_t at = isPattern ? name.rfind(head) : 0;
        if (at == std::string::npos || name.size() < at + head.size() + ending.size() || !name.ends_with(ending) ||
            name.compare(at, head.size(), head) != 0 || name.front() != '.')
            continue;
        const std::size_t begin = at + head.size();
        if (!isTag(std::string_view(name).substr(begin, name.size() - ending.size() - begin))) continue;
        if (!isPattern || frameNumberOf(finalName.native(), name.substr(1, at - 1) + ending)) return true;
    }
    return false;
}

bool isStillThere(int file, const std::string& path)
{
    struct stat open {
    }, named{};
    return fstat(file, &open) == 0 && stat(path.c_str(), &named) == 0 && open.st_ino == named.st_ino &&
           open.st_dev == named.st_dev;
}

/// The lock of a file whose maker is dead, as an open descriptor; nothing if somebody holds it or nobody can.
std::optional<int> lockOfTheDead(const std::string& path)
{
    const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (file < 0) return std::nullopt;
    if (flock(file, LOCK_EX | LOCK_NB) == 0 && isStillThere(file, path)) return file;
    close(file);
    return std::nullopt;
}

}  // namespace

AtomicFile::AtomicFile(std::string finalPath, const char* mark) : finalPath_(std::move(finalPath))
{
    static std::atomic<unsigned> count{0};  // names in this process differ
    const fs::path path(finalPath_);
    const std::string head = headOf(path.filename(), mark), host = hostName();
    for (;;) {
        const std::string name = fmt::format("{}{}-{}-{}{}", head, host, getpid(), count++, path.extension().native());
        temporaryPath_ = (path.parent_path() / name).native();
        locked_ = open(temporaryPath_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (locked_ < 0 && errno == EEXIST) continue;
        if (locked_ < 0) throw Error(ErrorCode::Output, "{}: cannot be written ({})", finalPath_, std::strerror(errno));
        while (flock(locked_, LOCK_EX) != 0 && errno == EINTR) {
        }
        // Between the two calls another run may have taken it for a dead one's.
        if (isStillThere(locked_, temporaryPath_)) return;
        close(locked_);
    }
}

AtomicFile::~AtomicFile()
{
    if (locked_ < 0) return;
    unlink(temporaryPath_.c_str());
    close(locked_);
}

void AtomicFile::write(std::string_view bytes)
{
    while (!bytes.empty()) {
        const ssize_t written = ::write(locked_, bytes.data(), bytes.size());
        if (written < 0 && errno != EINTR)
            throw Error(ErrorCode::Output, "{}: cannot be written ({})", finalPath_, std::strerror(errno));
        bytes.remove_prefix(std::size_t(std::max<ssize_t>(written, 0)));
    }
}

void AtomicFile::commit()
{
    // Network file systems may say only at a close that there was no room; the lock stays until the last one.
    if (close(dup(locked_)) != 0)
        throw Error(ErrorCode::Output, "{}: cannot be written ({})", finalPath_, std::strerror(errno));
    std::error_code error;
    fs::rename(temporaryPath_, finalPath_, error);
    if (error) throw Error(ErrorCode::Output, "{}: cannot be given its name: {}", finalPath_, error.message());
    close(locked_);
    locked_ = -1;
}

MemoryFile::MemoryFile() : file_(memfd_create("picture", MFD_CLOEXEC))
{
    if (file_ < 0) throw Error(ErrorCode::Output, "no memory for a picture's file ({})", std::strerror(errno));
}

MemoryFile::~MemoryFile() { close(file_); }

std::string MemoryFile::path() const { return fmt::format("/proc/self/fd/{}", file_); }

void MemoryFile::writeTo(AtomicFile& file) const
{
    std::vector<char> piece(std::size_t(1) << 20);
    for (off_t at = 0;;) {
        const ssize_t size = pread(file_, piece.data(), piece.size(), at);
        if (size < 0 && errno == EINTR) continue;
        if (size < 0)
            throw Error(ErrorCode::Output, "{}: cannot be written ({})", file.finalPath(), std::strerror(errno));
        if (size == 0) return;
        file.write({piece.data(), std::size_t(size)});
        at += size;
    }
}

void writeWholeFile(const std::string& path, std::string_view content)
{
    checkOutputFolder(path);
    sweepLeftovers(path);
    AtomicFile whole(path);
    whole.write(content);
    whole.commit();
}

std::vector<std::string> findLeftovers(const std::string& path)
{
    const fs::path folder = folderOf(path), finalName = fs::path(path).filename();
    const bool isPattern = isFramePattern(path);
    std::vector<std::string> found;
    std::error_code error;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
        if (!isTemporaryOf(entry->path().filename().native(), finalName, isPattern)) continue;
        const std::string left = (fs::path(path).parent_path() / entry->path().filename()).native();
        if (const auto lock = lockOfTheDead(left)) {
            close(*lock);
            found.push_back(left);
        }
    }
    std::sort(found.begin(), found.end());
    return found;
}

void removeLeftovers(const std::vector<std::string>& files) noexcept
{
    for (const std::string& file : files)
        if (const auto lock = lockOfTheDead(file)) {
            unlink(file.c_str());
            close(*lock);
        }
}

void sweepLeftovers(const std::string& path)
{
    const std::vector<std::string> left = findLeftovers(path);
    if (left.empty()) return;
    log::warning("{}: an earlier run was cut off; {}{} removed", path, left.front(),
                 left.size() == 1 ? " is" : fmt::format(" and {} more like it are", left.size() - 1));
    removeLeftovers(left);
}

void checkOutputFolder(const std::string& path)
{
    std::error_code error;
    if (path.empty()) throw Error(ErrorCode::Output, "the output has no name");
    if (fs::is_directory(path, error))
        throw Error(ErrorCode::Output, "{}: is a folder; name a file or a pattern in it, such as {}", path,
                    (fs::path(path) / "rain.%04d.exr").string());
    const fs::path folder = folderOf(path);
    if (!fs::exists(folder, error))
        throw Error(ErrorCode::Output, "{}: the folder {} does not exist", path, folder.string());
    if (!fs::is_directory(folder, error))
        throw Error(ErrorCode::Output, "{}: {} is not a folder", path, folder.string());
    // Renaming over a pipe would leave whoever reads it waiting, and over a device would take it away.
    if (fs::exists(path, error) && !fs::is_regular_file(path, error))
        throw Error(ErrorCode::Output, "{}: is a pipe or a device; write movies to standard output (-o -) instead",
                    path);
    if (access(folder.c_str(), W_OK | X_OK) != 0)
        throw Error(ErrorCode::Output, "{}: the folder {} cannot be written to: {}", path, folder.string(),
                    std::strerror(errno));
}

bool isSameFile(const std::string& a, const std::string& b) noexcept
{
    std::error_code error;
    return fs::equivalent(a, b, error) && !error;
}

}  // namespace virga::io
