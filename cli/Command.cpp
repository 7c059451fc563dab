#include "Command.h"

#include <cstdio>
#include <new>

#include "core/Error.h"
#include "core/Log.h"
#include "core/Parallel.h"
#include "gl/Context.h"

namespace virga::cli {

void addCommonFlags(CLI::App& command, CommonFlags& flags)
{
    command.add_flag("--quiet", flags.quiet, "say nothing but errors");
    command.add_flag("--verbose", flags.verbose, "say more");
    command.add_flag("--json", flags.json, "print one report object on standard output");
    command.add_option("--threads", flags.threads, "threads to use; 0 is all cores")->check(CLI::Range(0, 1024));
    command.add_option("--device", flags.device, "auto, cpu, gpu or a number (see virga info)")
        ->check([](const std::string& name) {
            return gl::isDeviceName(name) ? std::string() : "'" + name + "' must be auto, cpu, gpu or a device number";
        });
}

int runCommand(const CommonFlags& flags, const std::function<int(const CommonFlags&)>& body)
{
    log::setLevel(flags.quiet ? log::Level::Quiet : flags.verbose ? log::Level::Verbose : log::Level::Normal);
    const ThreadLimit limit(flags.threads);
    try {
        return body(flags);
    } catch (const Error& error) {
        std::fprintf(stderr, "virga: %s\n", error.what());
        return exitCode(error.code());
    } catch (const std::bad_alloc&) {
        std::fprintf(stderr, "virga: out of memory\n");
        return exitCode(ErrorCode::Internal);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "virga: internal error: %s\n", error.what());
        return exitCode(ErrorCode::Internal);
    }
}

}  // namespace virga::cli
