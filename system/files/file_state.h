// Whether a file is still the one that it was, without reading it.
#pragma once

#include <chrono>
#include <string>

namespace pbm {

// Device, number, size, times of modification and of change as text: two equal ones mean the same content, unless
// somebody wrote as many bytes within one step of the file system's clock. Programs that copy files set the time of
// modification, but no program sets that of change. Empty: there is no such file.
std::string file_state(const std::string &path);

// Whether a file that changes from now on is sure to have another state: its last change is more than a minute before
// `now`. The clock of a file server has steps of up to two seconds, and need not agree with this machine's.
bool is_settled(const std::string &path, std::chrono::system_clock::time_point now);

} // namespace pbm
