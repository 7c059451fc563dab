#include "Command.h"

#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <new>

#include "core/Error.h"
#include "core/Log.h"
#include "core/Parallel.h"
#include "gl/Context.h"
#include "shot/Parameters.h"

namespace virga::cli {

std::string fullName(const CLI::App& command)
{
    const CLI::App* const parent = command.get_parent();
    return (parent != nullptr ? fullName(*parent) + " " : "") + command.get_name();
}

void addCommonFlags(CLI::App& command, CommonFlags& flags)
{
    const char* const group = "Everywhere";
    command.set_help_flag("-h,--help", "this page")->group(group);
    command.add_flag("--quiet", flags.quiet, "say nothing but errors")->group(group);
    command.add_flag("--verbose", flags.verbose, "say more")->group(group);
    command.add_flag("--json", flags.json, "print one report object on standard output")->group(group);
    command.add_option("--threads", flags.threads, "threads to use (default 0: all cores; to 1024)")
        ->type_name("N")
        ->group(group)
        ->check([](const std::string& text) {
            int threads = -1;
            const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), threads);
            const bool isFine =
                error == std::errc() && end == text.data() + text.size() && threads >= 0 && threads <= 1024;
            return isFine ? std::string() : "'" + text + "': must be a whole number, 0 to 1024";
        });
    command.add_option("--device", flags.device, "auto, cpu, gpu or a number that 'virga info' lists (default auto)")
        ->type_name("NAME")
        ->group(group)
        ->check([](const std::string& name) {
            return gl::isDeviceName(name) ? std::string() : "'" + name + "': must be auto, cpu, gpu or a device number";
        });
}

void addOcioFlag(CLI::App& command, std::string& file, const char* group)
{
    command.add_option("--ocio", file, shot::findParameter("ocio").help)->type_name("FILE")->group(group);
}

int runCommand(const CommonFlags& flags, const std::function<int(const CommonFlags&)>& body)
{
    log::setLevel(flags.quiet ? log::Level::Quiet : flags.verbose ? log::Level::Verbose : log::Level::Normal);
    // Mesa tells standard error by itself why it has no device; our own sentence does.
    if (!flags.verbose) setenv("EGL_LOG_LEVEL", "fatal", 0);
    const ThreadLimit limit(flags.threads);
    try {
        const int code = body(flags);
        if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
            throw Error(ErrorCode::Output, "standard output: cannot be written to");
        return code;
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
