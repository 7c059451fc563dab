#include "io/AtomicFile.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "core/Error.h"

namespace virga::io {

namespace fs = std::filesystem;

namespace {

fs::path folderOf(const fs::path& path)
{
    const fs::path folder = path.parent_path();
    return folder.empty() ? fs::path(".") : folder;
}

}  // namespace

AtomicFile::AtomicFile(std::string finalPath, const char* mark) : finalPath_(std::move(finalPath))
{
    const fs::path path(finalPath_);
    const std::string name = fmt::format(".{}.{}{}", path.stem().string(), mark, path.extension().string());
    temporaryPath_ = (path.parent_path() / name).string();
}

AtomicFile::~AtomicFile()
{
    if (committed_) return;
    std::error_code ignored;  // it may never have been made
    fs::remove(temporaryPath_, ignored);
}

void AtomicFile::commit()
{
    std::error_code error;
    fs::rename(temporaryPath_, finalPath_, error);
    if (error) throw Error(ErrorCode::Output, "{}: cannot be given its name: {}", finalPath_, error.message());
    committed_ = true;
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
