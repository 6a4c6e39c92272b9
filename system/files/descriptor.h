// Open files as the system counts them, and what its calls say when they fail.
#pragma once

#include "system/bytes.h"
#include "system/error.h"

#include <string>
#include <utility>

namespace pbm {

// Closes at the end of a scope; `close()` early to see its error.
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

// Writes all of it, whatever the system takes at once. 0, or errno.
int write_all(int file, ByteView bytes);

// "`what`: " and the system's own text for an errno; `memory` for ENOMEM, else `io`.
Error io_error(const std::string &what, int number);

} // namespace pbm
