// File descriptors, and errors of system calls.
#pragma once

#include "system/bytes.h"
#include "system/error.h"

#include <string>
#include <utility>

namespace pbm {

// Owns a file descriptor and closes it at the end of a scope; `close()` reports the error.
class Descriptor {
  public:
    explicit Descriptor(int number = -1) : number_(number) {}
    Descriptor(Descriptor &&other) noexcept : number_(std::exchange(other.number_, -1)) {}
    Descriptor &operator=(Descriptor &&other) noexcept { return std::swap(number_, other.number_), *this; }
    Descriptor(const Descriptor &) = delete;
    Descriptor &operator=(const Descriptor &) = delete;
    ~Descriptor() { static_cast<void>(close()); }

    int number() const { return number_; }
    bool ok() const { return number_ >= 0; }
    int close(); // 0, or -1 and errno
    int release() { return std::exchange(number_, -1); }

  private:
    int number_;
};

// Opens a file to read; never waits for a pipe's writer. Not ok() and errno if that fails.
Descriptor open_to_read(const std::string &path);

// Opens a file to write behind its end, or creates it. Not ok() and errno if that fails: ENXIO for a pipe that nobody
// reads, for which others would wait.
Descriptor open_to_append(const std::string &path);

// Writes all bytes, in as many calls as the system needs. Returns 0 or errno.
int write_all(int file, ByteView bytes);

// Message: `what`, ": " and the system's text for the errno. Code: `memory` for ENOMEM, else `io`.
Error io_error(const std::string &what, int number);

} // namespace pbm
