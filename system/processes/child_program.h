// Another program that is fed through its standard input.
#pragma once

#include "system/bytes.h"
#include "system/error.h"
#include "system/files/descriptor.h"

#include <string>
#include <vector>

namespace pbm {

class ChildProgram {
  public:
    // Starts `arguments[0]`, which is looked for in PATH. Its standard output is dropped, the first line of its
    // standard error becomes part of messages.
    //
    // errors  memory (exit code 4)  there is no such program, or no process to be had
    //         io                    the system refuses pipes
    static Result<ChildProgram> start(const std::vector<std::string> &arguments);

    // errors  memory  it has ended or takes no more: why
    Status write(ByteView bytes);
    // Closes its input and waits for its end. The last call.
    //
    // errors  memory  it ended by a signal or not with 0: why
    Status finish();

    ChildProgram(ChildProgram &&other) noexcept;
    ChildProgram &operator=(ChildProgram &&) = delete;
    ChildProgram(const ChildProgram &) = delete;
    ChildProgram &operator=(const ChildProgram &) = delete;
    ~ChildProgram(); // without `finish` it is killed

  private:
    ChildProgram() = default;
    int wait(); // its status

    std::string name_;
    Descriptor input_, messages_;
    int id_ = -1;
};

} // namespace pbm
