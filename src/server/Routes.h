// Which request does what: the table of docs/openapi.json, in code.
#pragma once

#include "server/Engine.h"
#include "server/Http.h"

namespace virga::server {

class Routes {
public:
    explicit Routes(Engine& engine) : engine_(engine) {}

    /// Any request that has got this far. Does not throw: failures are answers.
    HttpAnswer answer(const HttpRequest& request) noexcept;

    /// For metrics: the kind of a path, never the path.
    static const char* kindOf(std::string_view path) noexcept;

    /// What is counted and the server itself knows.
    std::function<std::size_t()> connections = [] { return std::size_t(0); };

private:
    HttpAnswer route(const HttpRequest& request);
    HttpAnswer session(const HttpRequest& request, const std::vector<std::string>& parts);
    HttpAnswer frame(const HttpRequest& request, const std::string& id, const std::string& number, bool isPlate);
    HttpAnswer health() const;
    HttpAnswer metrics() const;
    std::string withoutPaths(std::string sentence) const;

    Engine& engine_;
};

/// The parameter table as JSON, with the name of each one's kind.
std::string parametersJson();

}  // namespace virga::server
