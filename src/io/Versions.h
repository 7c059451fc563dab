#pragma once

#include <map>
#include <string>

namespace virga::io {

/// Versions of the libraries that read and write, as they are at run time: name -> version.
std::map<std::string, std::string> libraryVersions();

}  // namespace virga::io
