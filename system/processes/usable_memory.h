// How much memory a program may plan with.
#pragma once

#include <cstdint>
#include <string>

namespace pbm {

// Bytes that this process may use: the physical memory, or less where a control group limits it, as in a container or a
// job of a batch system.
std::uint64_t usable_memory();

// The lowest limit of the memory of a process' control groups (versions 1 and 2) and of those above them, bytes; the
// largest number if there is none. `groups`: the text of /proc/self/cgroup; `mounted`: /sys/fs/cgroup.
std::uint64_t control_group_memory(const std::string &groups, const std::string &mounted);

} // namespace pbm
