// The folder that clients may read from, and nothing outside it: neither by "..", nor by absolute paths, nor through
// symbolic links, nor by naming a file inside a settings document.
//
// What is checked is what is there when it is checked. Whoever may write below the root can put a link in a file's
// place afterwards: the root belongs to people who could read those files anyway, or is mounted read-only
// (docs/server.md).
#pragma once

#include <string>

#include "core/FrameRange.h"
#include "shot/Settings.h"

namespace virga::server {

class ServedFolder {
public:
    /// Throws Error(InvalidArgument) if there is no such folder.
    explicit ServedFolder(const std::string& root);

    const std::string& path() const { return root_; }

    /// The real path of what a client calls `name`: relative to the root, or absolute and below it; a file, a folder,
    /// or a frame pattern. Each file of a pattern or a folder must lie below the root too. `what` names it in
    /// sentences. Throws Refusal 403 if it leaves the root, 404 if there is nothing.
    std::string resolve(const std::string& name, const char* what) const;

    /// All settings that name files, with the real paths; empty ones and words that are no files ("plate", "none" for a
    /// camera) stay. Throws as above.
    shot::Settings resolve(shot::Settings settings) const;

    /// What tells whether a file is the one that it was: place, size and time of change; of a pattern the frame's file.
    /// Empty if there is none.
    static std::string stampOf(const std::string& path, FrameNumber frame);

private:
    bool holds(const std::string& realPath) const;
    void checkFile(const std::string& path, const std::string& name, const char* what) const;

    std::string root_;
};

}  // namespace virga::server
