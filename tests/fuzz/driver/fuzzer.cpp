// libFuzzer's program over all targets: the first argument names one, the rest are libFuzzer's own.
//
//   virga_fuzz                          lists the targets
//   virga_fuzz lights --seeds FOLDER    writes its good inputs and its dictionary (FOLDER.dict)
//   virga_fuzz lights FOLDER -max_total_time=60
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "core/Log.h"
#include "fuzz/Targets.h"

namespace {

using virga::fuzz::Target;

Target chosen;

void writeSeeds(const std::string& folder)
{
    std::filesystem::create_directories(folder);
    for (std::size_t i = 0; i < chosen.seeds.size(); ++i)
        std::ofstream(folder + "/seed-" + std::to_string(i), std::ios::binary) << chosen.seeds[i];
    std::ofstream dictionary(folder + ".dict");
    for (const std::string& word : chosen.words) {
        dictionary << '"';
        for (const unsigned char c : word) {
            char escaped[8];
            std::snprintf(escaped, sizeof escaped, "\\x%02X", unsigned(c));
            dictionary << escaped;
        }
        dictionary << "\"\n";
    }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* count, char*** words)
{
    virga::log::setLevel(virga::log::Level::Quiet);
    const std::vector<Target> all = virga::fuzz::targets();
    if (*count < 2) {
        for (const Target& target : all) std::printf("%s\n", target.name);
        std::exit(0);
    }
    for (const Target& target : all)
        if (std::strcmp(target.name, (*words)[1]) == 0) chosen = target;
    if (chosen.take == nullptr) {
        std::fprintf(stderr, "no target is called '%s'\n", (*words)[1]);
        std::exit(2);
    }
    if (*count == 4 && std::strcmp((*words)[2], "--seeds") == 0) {
        writeSeeds((*words)[3]);
        std::exit(0);
    }
    (*words)[1] = (*words)[0];
    ++*words;
    --*count;
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    chosen.take({reinterpret_cast<const char*>(data), size});
    return 0;
}
