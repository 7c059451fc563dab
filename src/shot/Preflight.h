// `virga rain --check`: reads the headers of all inputs, and one depth image, and says what does not fit before
// anything is rendered. Writes nothing and opens no GL.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "shot/Doubts.h"
#include "shot/RainJob.h"

namespace virga::shot {

/// Everything that is found, in the order plate, depth, camera, light, output. What would end the work is a finding
/// too. Throws Error(InvalidArgument) for a plate that cannot be looked at twice (a pipe).
std::vector<Finding> checkRainJob(const Settings& settings, const RainJobOptions& options);

/// Whether rendering would end with an error.
bool holdsError(const std::vector<Finding>& findings);

/// A line a finding: severity, input, sentence and flag.
std::string findingsTable(const std::vector<Finding>& findings);
/// {"findings": [{"severity", "input", "sentence", "flag"}], "errors", "warnings"}.
std::string findingsJson(const std::vector<Finding>& findings);

/// What the result may take on disk beside what is free [bytes]: a warning if it is more.
Finding spaceFinding(const std::string& output, std::uint64_t needed, std::uint64_t free);
/// The same of memory.
Finding memoryFinding(std::uint64_t needed, std::uint64_t available);

}  // namespace virga::shot
