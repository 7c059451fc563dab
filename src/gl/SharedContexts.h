// One context a device for everything that a thread does, and the programs that were compiled in it: shots that come
// and go neither open the device again nor compile a shader twice.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "gl/Context.h"
#include "gl/Program.h"

namespace virga::gl {

/// One at a time on a thread. What it holds lives as long as it does, or as whoever uses it.
class SharedContexts {
public:
    SharedContexts();
    ~SharedContexts();
    SharedContexts(const SharedContexts&) = delete;
    SharedContexts& operator=(const SharedContexts&) = delete;

    /// Of this thread, or null.
    static SharedContexts* ofThread() noexcept;

    /// A context of `device`, see Context: the one that this thread's SharedContexts have, or a new one. Current.
    /// Throws as Context does, and the same once more without looking for the device again.
    static std::shared_ptr<const Context> open(const std::string& device);

    /// The program that was kept for the context that is current, or null.
    std::shared_ptr<const LinkedProgram> program(const std::string& key) const;
    /// Those that nobody uses go when there are more than `mostPrograms`.
    void keep(const std::string& key, std::shared_ptr<const LinkedProgram> program);

    static constexpr std::size_t mostPrograms = 256;

private:
    struct Held {
        std::shared_ptr<const Context> context;
        std::map<std::string, std::shared_ptr<const LinkedProgram>> programs;
    };
    std::shared_ptr<const Context> contextOf(const std::string& device);

    std::map<std::string, std::shared_ptr<Held>> byDevice_;  // several words may mean one device
    std::map<std::string, std::string> absent_;              // the sentences
    std::map<const Context*, std::shared_ptr<Held>> byContext_;
};

}  // namespace virga::gl
