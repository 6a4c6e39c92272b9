// Code that may crash, hang or take all memory, run in a process of its own under limits.
#pragma once

#include "system/bytes.h"
#include "system/error.h"

#include <cstdint>
#include <functional>
#include <string>

namespace pbm {

// What a child process may take; it ends where it wants more.
struct ChildLimits {
    unsigned cpu_seconds = 20;
    unsigned wall_seconds = 80;
    // Bytes of address space beyond what the caller has mapped. Not held where a sanitizer keeps its own books, nor
    // without /proc.
    std::uint64_t memory = std::uint64_t{256} << 20;
};

using ByteSink = std::function<void(ByteView)>;

struct ChildTask {
    std::string name;   // for messages: "the OBJ reader"
    std::string advice; // for messages: what to do when the child fails, "convert the scan to PLY"
    ChildLimits limits;
    std::function<Status(const ByteSink &send)> work; // runs in the child; `send` ends the child when the caller left
    std::function<Status(ByteView)> receive;          // runs in the caller: what the child sent, in order, cut anywhere
};

// Runs code that may crash, hang or take all memory in a copy of this process (fork without exec), where it sees the
// caller's memory as it was and changes only its own. Nothing of it outlives the call: no process, descriptor or core
// file, no exit handler and no buffered output of the caller's runs twice, and the child ends when the caller does.
// The child has no other descriptors than standard input (empty), output (dropped) and error (the first line becomes
// part of the message).
//
// Best called while the process has one thread. Of others the child has no copy, so that `work` may wait for a lock
// that one of them held (those of the system's malloc and stdio are safe, those of a sanitizer's malloc are not); it
// then ends at `wall_seconds`, as an error like others.
//
// errors  io         the system refuses pipes
//         memory     over a limit, killed by the system, or no child process can be had
//         bad_input  a signal, an exception, or an end before `work` returned
//         and those that `work` or `receive` return
Status run_in_child(const ChildTask &task);

} // namespace pbm
