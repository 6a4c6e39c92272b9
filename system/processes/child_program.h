// Runs another program and feeds its standard input.
#pragma once

#include "system/bytes.h"
#include "system/error.h"
#include "system/files/descriptor.h"

#include <string>
#include <vector>

namespace pbm {

class ChildProgram {
  public:
    // Starts `arguments[0]`, searched in PATH. Drops standard output; standard error's first line goes into messages.
    //
    // errors  memory (exit code 4)  the program is not installed, or no process can be started
    //         io                    no pipes
    static Result<ChildProgram> start(const std::vector<std::string> &arguments);

    // errors  memory  the program has ended or reads no more; the message says why
    Status write(ByteView bytes);
    // Closes the program's input and waits for its end. Must be the last call.
    //
    // errors  memory  a signal or a nonzero exit code; the message says why
    Status finish();

    ChildProgram(ChildProgram &&other) noexcept;
    ChildProgram &operator=(ChildProgram &&) = delete;
    ChildProgram(const ChildProgram &) = delete;
    ChildProgram &operator=(const ChildProgram &) = delete;
    ~ChildProgram(); // kills the program if `finish` was not called

  private:
    ChildProgram() = default;
    int wait(); // exit status

    std::string name_;
    Descriptor input_, messages_;
    int id_ = -1;
};

} // namespace pbm
