#include "bench/ChildProcess.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/Error.h"
#include "core/Timer.h"

namespace virga::bench {
namespace {

std::string contentOf(const std::string& path)
{
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
}

std::string lastLine(std::string text)
{
    while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
    return text.substr(text.find_last_of('\n') + 1);
}

double secondsOf(const timeval& time) { return double(time.tv_sec) + 1e-6 * double(time.tv_usec); }

}  // namespace

TemporaryFolder::TemporaryFolder()
{
    path_ = (std::filesystem::temp_directory_path() / "virga-bench-XXXXXX").string();
    if (mkdtemp(path_.data()) == nullptr)
        throw Error(ErrorCode::Output, "'{}': the folder cannot be made: {}", path_, std::strerror(errno));
}

TemporaryFolder::~TemporaryFolder()
{
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

ChildRun runChild(const std::vector<std::string>& words, const std::string& logs)
{
    const std::string out = logs + "/stdout.txt", err = logs + "/stderr.txt";
    std::vector<char*> arguments;
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_addopen(&files, STDERR_FILENO, err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    const Timer clock;
    pid_t child = 0;
    const int problem = posix_spawnp(&child, words.front().c_str(), &files, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&files);
    if (problem != 0)
        throw Error(ErrorCode::Input, "'{}' cannot be started: {}", words.front(), std::strerror(problem));
    int status = 0;
    rusage used{};
    while (wait4(child, &status, 0, &used) < 0)
        if (errno != EINTR) throw Error(ErrorCode::Internal, "'{}' got lost: {}", words.front(), std::strerror(errno));
    ChildRun run{clock.seconds(), secondsOf(used.ru_utime) + secondsOf(used.ru_stime), {}};
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
        throw Error(ErrorCode::Input, "'{}' failed: {}", words.front(), lastLine(contentOf(err)));
    run.output = contentOf(out);
    return run;
}

}  // namespace virga::bench
