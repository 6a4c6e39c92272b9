// The one home of what differs between operating systems: mapping files and replacing them atomically.
#pragma once

#include "pbm_format/bytes.h"
#include "pbm_format/error.h"

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

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

// Whether a replaced file survives a power cut right after. `cached` is for what is quickly made again, as pictures
// are: the system writes it to the disk in its own time.
enum class Durability { synced, cached };

// Writes a file piece by piece and makes `path` name it at the end, or leaves `path` as it was: temporary sibling,
// writes, fsync, rename, fsync of the folder (both where `synced`). Links stay; the file that they name is replaced, or
// made. Written to directly: open files of this process ("-", which is standard output, /dev/stdout, /dev/stderr,
// /dev/fd/N), character devices, pipes.
//
// The sibling is `path`.pbm-1, locked, or the first such number that no process holds. One that a killed process left
// is written over by the next that writes the same file, or removed.
class FileReplacement {
  public:
    static Result<FileReplacement> begin(const std::string &path);
    Status write(ByteView bytes);
    // Writes over what was written before; `offset` bytes from the start.
    //
    // errors  io  also where it is written to directly and has no places, as a pipe
    Status overwrite(std::uint64_t offset, ByteView bytes);
    // The name under which another program may fill the file before `finish`.
    const std::string &name_until_finished() const { return sibling_.empty() ? target_ : sibling_; }
    Status finish(Durability durability = Durability::synced); // the last call

    FileReplacement(FileReplacement &&other) noexcept;
    FileReplacement &operator=(FileReplacement &&) = delete;
    FileReplacement(const FileReplacement &) = delete;
    FileReplacement &operator=(const FileReplacement &) = delete;
    ~FileReplacement(); // without `finish`, `path` stays as it was

  private:
    FileReplacement() = default;

    int file_ = -1, folder_ = -1;  // the folder of both names, wherever it is moved to
    std::string target_, sibling_; // `sibling_` is empty where it is written to directly
    unsigned mode_ = 0;
};

// The same in one piece.
Status replace_file(const std::string &path, ByteView bytes, Durability durability = Durability::synced);

// Says early whether `path` can be replaced: the folder exists and takes a file, `path` is no folder.
Status check_replaceable(const std::string &path);

// Signals that would end a program whose write fails (SIGPIPE, SIGXFSZ) become error returns, and so does the use of a
// standard stream that the caller has closed. Call first in `main`.
void make_write_errors_returns();

// A mapped file that another process makes shorter ends the program with a line on standard error and exit code 2
// instead of SIGBUS. Call first in `main`.
void end_when_mapped_file_shrinks(std::string_view program);

// Lets the heap of a program that soon fills some 10 MB and then ends grow at once and in pages of 2 MB, where C
// library and kernel can: touching a small page for the first time takes a microsecond. Call first in `main`.
void use_large_pages();

// Largest resident memory of this process so far, bytes.
std::uint64_t peak_memory();

} // namespace pbm
