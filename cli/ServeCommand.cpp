#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "Command.h"
#include "Interrupt.h"
#include "core/Error.h"
#include "core/KeptFiles.h"
#include "core/Log.h"
#include "server/Engine.h"
#include "server/Server.h"
#include "shot/Parameters.h"

namespace virga::cli {
namespace {

struct ServeArguments {
    CommonFlags common;
    server::ServeOptions serve;
    std::string listen, tokenFile, settingsFile;
    bool noSocket = false, noCache = false, logJson = false;
    double bodyMib = 256, cacheMib = 512, sharedMib = 256, idle_s = 1800;
};

const char* const examples = R"(Examples:
  virga serve --root /shots --listen 8717 --plate street.mp4     the page for the artist: open the address that it prints
  virga serve --root /shots --socket /run/user/1000/virga.sock   for programs of this machine
  curl --unix-socket virga.sock -H 'Content-Type: application/json' -d '{"plate": "street.mp4"}' http://localhost/sessions
docs/server.md has the interface, docs/openapi.json its description.)";

std::string firstWord(const std::string& path)
{
    std::ifstream file(path);
    std::string word;
    file >> word;
    return word;
}

/// From $VIRGA_TOKEN, else the file if there is one, else made, and put into the file, which no one else may read.
std::string tokenOf(const ServeArguments& arguments)
{
    if (const char* given = std::getenv("VIRGA_TOKEN"); given != nullptr && *given != 0) return given;
    if (arguments.tokenFile.empty()) return server::randomName();
    std::string token = firstWord(arguments.tokenFile);
    if (!token.empty()) return token;
    token = server::randomName();
    const int file = open(arguments.tokenFile.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    const std::string line = token + "\n";
    const bool isWritten = file >= 0 && write(file, line.data(), line.size()) == ssize_t(line.size());
    if (file >= 0) close(file);
    if (!isWritten)
        throw Error(ErrorCode::Output, "--token-file '{}': holds no token and cannot be made", arguments.tokenFile);
    return token;
}

std::string standardSocket()
{
    const char* const folder = std::getenv("XDG_RUNTIME_DIR");
    if (folder == nullptr || *folder != '/')
        throw Error(ErrorCode::InvalidArgument,
                    "--socket: there is no XDG_RUNTIME_DIR to put it into; name one, or say --listen and --no-socket");
    return std::string(folder) + "/virga.sock";
}

int serve(ServeArguments& a)
{
    server::ServeOptions& options = a.serve;
    options.device = a.common.device;
    if (!a.noCache) options.cacheFolder = keptFilesFolder();
    if (a.logJson) log::useJsonLines();
    if (!a.listen.empty()) {
        options.address = server::parseTcpAddress(a.listen);
        options.token = tokenOf(a);
    } else if (options.isPublic || !a.tokenFile.empty()) {
        throw Error(ErrorCode::InvalidArgument, "--public and --token-file go with --listen");
    }
    if (a.noSocket && !options.socket.empty())
        throw Error(ErrorCode::InvalidArgument, "--socket and --no-socket exclude each other");
    // A page needs no socket; a program that asked for none has one all the same.
    if (options.socket.empty() && !a.noSocket && !options.address) options.socket = standardSocket();
    if (!a.settingsFile.empty()) {
        if (options.plate.empty())
            throw Error(ErrorCode::InvalidArgument, "--settings are those of --plate, which is not given");
        shot::loadSettings(options.settings, a.settingsFile);
    }
    constexpr double mib = 1048576;
    options.http.mostBodyBytes = std::uint64_t(a.bodyMib * mib);
    options.engine.cacheBytes = std::size_t(a.cacheMib * mib);
    options.engine.sharedBytes = std::size_t(a.sharedMib * mib);
    options.engine.idle = std::chrono::seconds(long(a.idle_s));
    noteInterrupts();
    server::serve(
        options,
        [&](const server::Serving& serving) {
            if (a.common.json) {
                using nlohmann::json;
                const json ready = {{"socket", options.socket.empty() ? json() : json(options.socket)},
                                    {"url", serving.url.empty() ? json() : json(serving.url)},
                                    {"port", serving.port},
                                    {"token", options.token.empty() ? json() : json(options.token)}};
                std::printf("%s\n", ready.dump(-1, ' ', false, json::error_handler_t::replace).c_str());
            } else {
                if (!options.socket.empty()) std::printf("%s\n", options.socket.c_str());
                if (!serving.url.empty()) std::printf("%s\n", serving.url.c_str());
            }
            std::fflush(stdout);
        },
        isInterrupted);
    return 0;
}

}  // namespace

Runner addServeCommand(CLI::App& app, CLI::App*& command)
{
    command = app.add_subcommand("serve", "frames on demand, for programs and browsers");
    command->footer(examples);
    const auto arguments = std::make_shared<ServeArguments>();
    ServeArguments& a = *arguments;
    const char* const who = "Who may ask";
    command->add_option("--root", a.serve.root, "the folder that plates and all other files come from (default .)")
        ->type_name("FOLDER")
        ->group(who);
    command
        ->add_option("--socket", a.serve.socket,
                     "listen on a Unix socket, for this user alone (default, without --listen: "
                     "$XDG_RUNTIME_DIR/virga.sock)")
        ->type_name("PATH")
        ->group(who);
    command->add_flag("--no-socket", a.noSocket, "listen on no Unix socket")->group(who);
    command->add_option("--listen", a.listen, "listen on TCP too: 8717, 127.0.0.1:8717; 0 is any free port")
        ->type_name("[ADDRESS:]PORT")
        ->group(who);
    command->add_flag("--public", a.serve.isPublic, "allow --listen on an address that other machines reach")
        ->group(who);
    command
        ->add_option("--token-file", a.tokenFile,
                     "take the token that TCP asks for from this file, or make both; else $VIRGA_TOKEN, else a new one")
        ->type_name("FILE")
        ->group(who);
    const char* const first = "A session from the start";
    command->add_option("--plate", a.serve.plate, "open a session with this plate, below --root")
        ->type_name("PLATE")
        ->group(first);
    command->add_option("--settings", a.settingsFile, "its settings")->type_name("TOML")->group(first);
    const char* const limits = "Limits";
    const auto number = [&](const char* flag, auto& value, const char* help, const char* unit, double least,
                            double most) {
        command->add_option(flag, value, help)
            ->type_name(unit)
            ->group(limits)
            ->check([least, most](const std::string& text) {
                char* end = nullptr;
                const double given = std::strtod(text.c_str(), &end);
                return *end == 0 && given >= least && given <= most
                           ? std::string()
                           : fmt::format("'{}': must be {:g} to {:g}", text, least, most);
            });
    };
    number("--sessions", a.serve.engine.sessions, "sessions at a time (default 16)", "N", 1, 1000);
    number("--idle", a.idle_s, "close a session that nobody has used for so long (default 1800)", "s", 1, 1e7);
    number("--megapixels", a.serve.engine.megapixels, "of a frame, at most (default 40)", "N", 0.001, 268);
    number("--queue", a.serve.engine.queue, "frames that may wait to be rendered (default 64)", "N", 1, 1000);
    number("--prefetch", a.serve.engine.prefetch, "neighbours of a viewer's frame that are rendered ahead (default 2)",
           "N", 0, 100);
    number("--max-body", a.bodyMib, "of a request, at most (default 256)", "MiB", 0.001, 65536);
    number("--cache", a.cacheMib, "frames kept in memory (default 512)", "MiB", 0, 1048576);
    number("--shared", a.sharedMib, "shared memory handed out (default 256)", "MiB", 1, 1048576);
    const char* const more = "More";
    command->add_flag("--log-json", a.logJson, "log as JSON, an object a line; --verbose logs each request")
        ->group(more);
    command
        ->add_flag("--no-cache", a.noCache,
                   "neither use nor keep compiled shaders and the light of panoramas (in XDG_CACHE_HOME/virga)")
        ->group(more);
    addCommonFlags(*command, a.common);
    return [arguments] { return runCommand(arguments->common, [&](const CommonFlags&) { return serve(*arguments); }); };
}

}  // namespace virga::cli
