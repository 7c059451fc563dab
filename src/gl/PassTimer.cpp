#include "gl/PassTimer.h"

namespace virga::gl {

PassTimer::~PassTimer() { glDeleteQueries(GLsizei(queries_.size()), queries_.data()); }

GLuint PassTimer::nextQuery()
{
    if (used_ == queries_.size()) {
        queries_.push_back(0);
        glCreateQueries(GL_TIMESTAMP, 1, &queries_.back());
    }
    return queries_[used_++];
}

void PassTimer::begin()
{
    used_ = 0;
    names_.clear();
    glQueryCounter(nextQuery(), GL_TIMESTAMP);
}

void PassTimer::mark(const char* pass)
{
    names_.emplace_back(pass);
    glQueryCounter(nextQuery(), GL_TIMESTAMP);
}

std::vector<std::pair<std::string, double>> PassTimer::collect()
{
    std::vector<std::pair<std::string, double>> times;
    GLuint64 before = 0;
    for (std::size_t i = 0; i < used_; ++i) {
        GLuint64 stamp = 0;
        glGetQueryObjectui64v(queries_[i], GL_QUERY_RESULT, &stamp);
        if (i > 0) times.emplace_back(names_[i - 1], 1e-6 * double(stamp - before));
        before = stamp;
    }
    return times;
}

}  // namespace virga::gl
