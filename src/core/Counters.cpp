#include "core/Counters.h"

namespace virga {

Counters& counters() noexcept
{
    static Counters ofProcess;
    return ofProcess;
}

}  // namespace virga
