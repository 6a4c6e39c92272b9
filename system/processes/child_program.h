// Runs another program: feeds its standard input, or reads its standard output.
#pragma once

#include "system/bytes.h"
#include "system/error.h"
#include "system/files/descriptor.h"

#include <functional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

namespace pbm {

// The path of a program of ours: beside the one that runs, else in PATH. Empty if it is not there.
std::string find_program(std::string_view name);

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

struct ProgramEnd {
    int exit_code;       // -1: a signal ended the program
    std::string message; // the last line of its standard error, at most 4 KB; may be empty
};

// Runs `arguments[0]`, searched in PATH, to its end; it has no input. Calls `line` for each line of its standard
// output, without the line feed; bytes after 64 KB of a line are dropped. A stop request kills the program at once,
// from the thread that makes the request.
//
// errors  memory (exit code 4)  the program is not installed, or no process can be started
//         io                    no pipes
Result<ProgramEnd> run_program(const std::vector<std::string> &arguments,
                               const std::function<void(std::string_view)> &line, const std::stop_token &stop = {});

} // namespace pbm
