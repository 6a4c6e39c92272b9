// Files mapped into memory, read-only, and streams read to their end.
#pragma once

#include "system/bytes.h"
#include "system/error.h"

#include <cstdint>
#include <functional>
#include <string>

namespace pbm {

// A file mapped read-only. Refuses what is not a regular file. Moves, never copies; the view lives as long as it.
class MappedFile {
  public:
    static Result<MappedFile> open(const std::string &path);
    // Reads a stream (is_stream) to its end, into memory that this then holds. `wanted` is asked once, when
    // kStreamStart bytes or all there are have come, how many bytes to read at most: the rest stays unread.
    //
    // errors  io      the system's own text; standard input is a terminal
    //         bad_input  a megabyte of zeros to begin with, as from a device that would never end
    //         memory  more than `max_bytes`, or more than there is
    static Result<MappedFile> read_stream(const std::string &path, std::uint64_t max_bytes,
                                          const std::function<std::uint64_t(ByteView start)> &wanted = {});
    static constexpr std::size_t kStreamStart = 128;

    MappedFile(MappedFile &&other) noexcept;
    MappedFile &operator=(MappedFile &&other) noexcept;
    MappedFile(const MappedFile &) = delete;
    MappedFile &operator=(const MappedFile &) = delete;
    ~MappedFile();

    ByteView bytes() const { return {data_, size_}; }

  private:
    MappedFile(const std::uint8_t *data, std::size_t size) : data_(data), size_(size) {}

    const std::uint8_t *data_ = nullptr;
    std::size_t size_ = 0;
};

// "-", which is standard input, and whatever has no size before it is read: a pipe, a socket, a character device.
bool is_stream(const std::string &path);

} // namespace pbm
