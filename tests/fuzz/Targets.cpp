#include "fuzz/Targets.h"

#include <sys/mman.h>
#include <unistd.h>

namespace virga::fuzz {

std::vector<Target> targets()
{
    std::vector<Target> all;
    for (auto some : {coreTargets(), cameraTargets(), matteTargets(), ioTargets(), shotTargets(), serverTargets()})
        for (Target& target : some) all.push_back(std::move(target));
    return all;
}

std::string fileOf(std::string_view content)
{
    static const int file = memfd_create("fuzz", MFD_CLOEXEC);
    require(ftruncate(file, 0) == 0 && pwrite(file, content.data(), content.size(), 0) == ssize_t(content.size()),
            "memory holds the file");
    return "/proc/self/fd/" + std::to_string(file);
}

}  // namespace virga::fuzz
