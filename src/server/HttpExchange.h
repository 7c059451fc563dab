// A request and its answer on a connection, read and written by cpp-httplib.
#pragma once

#include <memory>

#include "server/Connection.h"
#include "server/Http.h"

namespace virga::server {

/// Thread-safe.
class HttpExchange {
public:
    HttpExchange(const HttpLimits& limits, HttpServer::Handler handler, HttpServer::Note note);
    ~HttpExchange();
    HttpExchange(const HttpExchange&) = delete;
    HttpExchange& operator=(const HttpExchange&) = delete;

    /// The request whose head is pending on the connection and was found good. closes: the answer says that no other
    /// will be taken. False: the connection is to be closed.
    bool serve(Connection& connection, std::uint64_t id, const RequestHead& head, bool closes);

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace virga::server
