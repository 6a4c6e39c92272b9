// Replaces run_in_child for a target whose inputs hold images: a fork of a sanitized process takes longer than the
// rest. A crash of a library ends the target. CMakeLists.txt gives the linker the name.
#include "system/processes/child_process.h"

#include <exception>

namespace pbm {

// The calls of run_in_child come here (ld, --wrap).
Status run_in_this_process(const ChildTask &task) asm("__wrap__ZN3pbm12run_in_childERKNS_9ChildTaskE");

Status run_in_this_process(const ChildTask &task) {
    Status received;
    try {
        Status done = task.work([&](ByteView bytes) {
            if (received)
                received = task.receive(bytes);
        });
        return done ? received : done;
    } catch (const std::exception &e) {
        return Error{ErrorCode::bad_input, 0, task.name + ": " + e.what()};
    }
}

} // namespace pbm
