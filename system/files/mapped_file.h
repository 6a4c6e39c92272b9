// Maps files into memory, read-only, and reads streams to their end.
// Stability: stable.
#pragma once

#include "system/bytes.h"
#include "system/error.h"

#include <cstdint>
#include <functional>
#include <string>

namespace pbm {

// A file mapped read-only; regular files only. Movable, not copyable; views live as long as the object.
class MappedFile {
  public:
    static Result<MappedFile> open(const std::string &path);
    // Reads a stream (is_stream) to its end into memory owned by the result. `wanted` is called once at least
    // kStreamStart bytes are read; it returns the number of bytes to read at most, and the rest stays unread.
    //
    // errors  io         the system's text; standard input is a terminal
    //         bad_input  the first megabyte is zeros, as from a device that never ends
    //         memory     more than `max_bytes`, or out of memory
    static Result<MappedFile> read_stream(const std::string &path, std::uint64_t max_bytes,
                                          const std::function<std::uint64_t(ByteView start)> &wanted = {});
    static constexpr std::size_t kStreamStart = 128;

    MappedFile(MappedFile &&other) noexcept;
    MappedFile &operator=(MappedFile &&other) noexcept;
    MappedFile(const MappedFile &) = delete;
    MappedFile &operator=(const MappedFile &) = delete;
    ~MappedFile();

    ByteView bytes() const { return {data_, size_}; }
    // Reads no more from the disk than will_need names and single pages that are touched. Without, touching a page may
    // read megabytes around it.
    void read_sparsely();
    // Starts to read these bytes of a mapped file from the disk and returns before they are there: for ByteSource.
    static void will_need(ByteView bytes);

  private:
    MappedFile(const std::uint8_t *data, std::size_t size) : data_(data), size_(size) {}

    const std::uint8_t *data_ = nullptr;
    std::size_t size_ = 0;
};

// True for "-" (standard input) and for files without a known size: pipes, sockets, character devices.
bool is_stream(const std::string &path);

} // namespace pbm
