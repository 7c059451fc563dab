// GPU time of named passes by timestamp queries.
#pragma once

#include <epoxy/gl.h>

#include <string>
#include <utility>
#include <vector>

namespace virga::gl {

/// Usage, once a frame: begin(); after each pass mark("name"); then collect(), which waits for the last of them.
class PassTimer {
public:
    PassTimer() = default;
    ~PassTimer();
    PassTimer(const PassTimer&) = delete;
    PassTimer& operator=(const PassTimer&) = delete;

    void begin();
    void mark(const char* pass);
    /// Milliseconds of GPU time from the mark before (or begin) to each mark, in order.
    std::vector<std::pair<std::string, double>> collect();

private:
    GLuint nextQuery();
    std::vector<GLuint> queries_;
    std::vector<std::string> names_;  // of queries_[1..]
    std::size_t used_ = 0;
};

}  // namespace virga::gl
