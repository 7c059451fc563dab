#include "server/ServedFolder.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <filesystem>
#include <system_error>

#include "core/Error.h"
#include "io/Plate.h"
#include "server/Refusal.h"

namespace virga::server {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& name, const char* what)
{
    throw Refusal(403, "outside-root", "{} '{}': leaves the folder that is served", what, shortened(name, 200));
}

[[noreturn]] void missing(const std::string& name, const char* what)
{
    throw Refusal(404, "not-found", "{} '{}': no such file below the folder that is served", what,
                  shortened(name, 200));
}

}  // namespace

ServedFolder::ServedFolder(const std::string& root)
{
    std::error_code error;
    root_ = fs::canonical(root, error).string();
    if (error || !fs::is_directory(root_, error))
        throw Error(ErrorCode::InvalidArgument, "--root '{}': is no folder", root);
}

bool ServedFolder::holds(const std::string& realPath) const
{
    return root_ == "/" || realPath == root_ || realPath.starts_with(root_ + "/");
}

void ServedFolder::checkFile(const std::string& path, const std::string& name, const char* what) const
{
    std::error_code error;
    const std::string real = fs::canonical(path, error).string();
    if (error ? fs::is_symlink(path) : !holds(real)) refuse(name, what);
}

std::string ServedFolder::resolve(const std::string& name, const char* what) const
{
    if (name.empty() || name.size() > 4000 || name.find('\0') != std::string::npos) missing(name, what);
    const fs::path asked = (fs::path(root_) / name).lexically_normal();  // an absolute name takes the root's place
    if (!holds(asked.string())) refuse(name, what);
    std::error_code error;
    const fs::path whole = fs::canonical(asked, error);
    if (!error) {
        if (!holds(whole.string())) refuse(name, what);
        if (fs::is_directory(whole)) {
            std::size_t seen = 0;
            for (auto at = fs::recursive_directory_iterator(whole, error); !error && at != fs::end(at);
                 at.increment(error)) {
                if (++seen > 100000)
                    throw Refusal(403, "too-many-files", "{} '{}': the folder holds over 100000 files", what, name);
                if (at->is_symlink()) checkFile(at->path().string(), name, what);
            }
        } else if (!fs::is_regular_file(whole)) {
            missing(name, what);  // pipes and devices would be waited for
        }
        return whole.string();
    }
    if (fs::is_symlink(asked)) refuse(name, what);
    const fs::path folder = fs::canonical(asked.parent_path(), error);
    if (error || !io::isFramePattern(asked.filename().string())) missing(name, what);
    if (!holds(folder.string())) refuse(name, what);
    const std::string pattern = (folder / asked.filename()).string();
    bool isThere = false;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
        if (!io::frameNumberOf(pattern, entry.path().filename().string())) continue;
        isThere = true;
        if (entry.is_symlink()) checkFile(entry.path().string(), name, what);
    }
    if (!isThere) missing(name, what);
    return pattern;
}

shot::Settings ServedFolder::resolve(shot::Settings s) const
{
    const auto file = [&](std::string& path, const char* what) {
        if (!path.empty()) path = resolve(path, what);
    };
    file(s.depth, "depth"), file(s.env, "env"), file(s.lights, "lights"), file(s.gradeFrom, "grade-from"),
        file(s.ocio, "ocio");
    if (s.camera != "plate" && s.camera != "none") file(s.camera, "camera");
    if (!s.mattes.empty()) {
        file(s.mattes, "mattes");
        // The atlas's description lies beside it.
        std::error_code error;
        const fs::path beside = fs::path(s.mattes).replace_extension(".json");
        if (fs::exists(fs::symlink_status(beside, error))) checkFile(beside.string(), s.mattes, "mattes");
    }
    return s;
}

std::string ServedFolder::stampOf(const std::string& path, FrameNumber frame)
{
    struct stat status {};
    const std::string file = io::isFramePattern(path) ? io::framePath(path, frame) : path;
    if (stat(file.c_str(), &status) != 0) return {};
    return fmt::format("{}:{}:{}:{}.{};", status.st_dev, status.st_ino, status.st_size, status.st_mtim.tv_sec,
                       status.st_mtim.tv_nsec);
}

}  // namespace virga::server
