// Runs code that may crash, hang or exhaust the memory in a child process under limits.
#pragma once

#include "system/bytes.h"
#include "system/error.h"

#include <cstdint>
#include <functional>
#include <string>

namespace pbm {

// Limits of a child process, which ends when it exceeds one.
struct ChildLimits {
    unsigned cpu_seconds = 20;
    unsigned wall_seconds = 80;
    // Bytes of address space beyond what the caller has mapped. Not enforced under sanitizers or without /proc.
    std::uint64_t memory = std::uint64_t{256} << 20;
};

using ByteSink = std::function<void(ByteView)>;

struct ChildTask {
    std::string name;   // for messages: "the OBJ reader"
    std::string advice; // for messages: advice if the child fails, "convert the scan to PLY"
    ChildLimits limits;
    std::function<Status(const ByteSink &send)> work; // runs in the child; `send` ends it if the caller has ended
    std::function<Status(ByteView)> receive;          // runs in the caller: receives the bytes in order, split anywhere
};

// Runs `work` in a copy of this process (fork without exec): the child sees the caller's memory as it was and changes
// only its own. Nothing outlives the call: no process, descriptor or core file. Exit handlers do not run in the child,
// and buffered output of the caller is not written twice. The child ends when the caller does. Its only descriptors are
// standard input (empty), output (dropped) and error (the first line becomes part of the message).
//
// Call it while the process has one thread, if possible. The child has no copy of other threads, so `work` may wait for
// a lock that one of them held, until `wall_seconds` end it with an error. Locks of the system's malloc and stdio are
// safe, those of a sanitizer's malloc are not.
//
// errors  io         no pipes
//         memory     over a limit, killed by the system, or no child process
//         bad_input  a signal, an exception, or an exit before `work` returned
//         and those that `work` or `receive` return
Status run_in_child(const ChildTask &task);

} // namespace pbm
