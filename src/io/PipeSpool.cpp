#include "io/PipeSpool.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <vector>

#include "core/Error.h"
#include "core/Log.h"

namespace virga::io {

namespace fs = std::filesystem;

namespace {

/// A file descriptor with an owner.
struct Descriptor {
    int number = -1;
    ~Descriptor()
    {
        if (number >= 0) close(number);
    }
};

std::string temporaryFolder()
{
    std::error_code error;
    const fs::path folder = fs::temp_directory_path(error);
    return error ? "/tmp" : folder.string();
}

[[noreturn]] void refuseFolder(const std::string& name, const std::string& folder)
{
    throw Error(ErrorCode::Output, "{}: cannot be kept in '{}' ({}); TMPDIR may name a folder with more room", name,
                folder, std::strerror(errno));
}

/// A file without a name, open for reading and writing.
int openNameless(const std::string& name, const std::string& folder)
{
    std::string pattern = folder + "/virga-XXXXXX";
    const int file = mkostemp(pattern.data(), O_CLOEXEC);
    if (file < 0) refuseFolder(name, folder);
    unlink(pattern.c_str());
    return file;
}

void writeAll(int file, const char* bytes, std::size_t count, const std::string& name, const std::string& folder)
{
    while (count > 0) {
        const ssize_t written = write(file, bytes, count);
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0) refuseFolder(name, folder);
        bytes += written;
        count -= std::size_t(written);
    }
}

}  // namespace

bool isPipe(const std::string& path)
{
    if (path == "-") return true;
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    return fs::is_fifo(status) || fs::is_socket(status);
}

PipeSpool::PipeSpool(const std::string& path)
{
    const bool isStandardInput = path == "-";
    const std::string name = isStandardInput ? "standard input" : path;
    Descriptor from{isStandardInput ? dup(STDIN_FILENO) : open(path.c_str(), O_RDONLY | O_CLOEXEC)};
    if (from.number < 0) throw Error(ErrorCode::Input, "{}: cannot be read ({})", name, std::strerror(errno));
    if (isatty(from.number) != 0)
        throw Error(ErrorCode::Input, "{}: is a terminal; send a movie down a pipe, or name a file", name);
    struct stat status = {};
    if (fstat(from.number, &status) == 0 && S_ISREG(status.st_mode)) {
        file_ = from.number;
        from.number = -1;
        return;
    }

    const std::string folder = temporaryFolder();
    Descriptor to{openNameless(name, folder)};
    std::vector<char> bytes(std::size_t(1) << 20);
    std::size_t total = 0;
    for (;;) {
        const ssize_t count = read(from.number, bytes.data(), bytes.size());
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) throw Error(ErrorCode::Input, "{}: cannot be read ({})", name, std::strerror(errno));
        if (count == 0) break;
        writeAll(to.number, bytes.data(), std::size_t(count), name, folder);
        total += std::size_t(count);
    }
    if (total == 0) throw Error(ErrorCode::Input, "{}: nothing came; did the sender fail?", name);
    log::detail("{}: {:.1f} MB are kept in {} until the end", name, double(total) / 1e6, folder);
    file_ = to.number;
    to.number = -1;
}

PipeSpool::~PipeSpool() { close(file_); }

std::string PipeSpool::path() const { return fmt::format("/proc/self/fd/{}", file_); }

}  // namespace virga::io
