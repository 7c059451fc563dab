// Other programs, run and timed.
#pragma once

#include <string>
#include <vector>

namespace virga::bench {

struct ChildRun {
    double seconds = 0;     ///< from start to end
    double processors = 0;  ///< time of all processors, user and system [s], which a busy machine does not stretch
    std::string output;     ///< what it wrote on standard output
};

/// A folder of its own for as long as it lives. Throws Error(Output).
class TemporaryFolder {
public:
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    const std::string& path() const { return path_; }

private:
    std::string path_;
};

/// Runs a program, the first word, found as the shell finds it, and waits for it. logs: a folder for what it says
/// meanwhile. Throws Error(Input) if it cannot be started or fails, with the last line of its standard error.
ChildRun runChild(const std::vector<std::string>& words, const std::string& logs);

}  // namespace virga::bench
