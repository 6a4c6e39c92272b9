// The one home of what differs between operating systems: mapping files, replacing them atomically, child processes.
#pragma once

#include "pbm_format/bytes.h"
#include "pbm_format/error.h"

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace pbm {

// A file mapped read-only. Refuses what is not a regular file. Moves, never copies; the view lives as long as it.
class MappedFile {
  public:
    static Result<MappedFile> open(const std::string &path);
    // Reads a stream (is_stream) to its end, into memory that this then holds.
    //
    // errors  io      the system's own text; standard input is a terminal
    //         memory  more than `max_bytes`, or more than there is
    static Result<MappedFile> read_stream(const std::string &path, std::uint64_t max_bytes);

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

// Writes a file piece by piece and makes `path` name it at the end, or leaves `path` as it was: temporary sibling,
// writes, fsync, rename, fsync of the folder. "-", which is standard output, and a path that names a character device
// or a pipe are written to directly.
class FileReplacement {
  public:
    static Result<FileReplacement> begin(const std::string &path);
    Status write(ByteView bytes);
    Status finish(); // the last call

    FileReplacement(FileReplacement &&other) noexcept;
    FileReplacement &operator=(FileReplacement &&) = delete;
    FileReplacement(const FileReplacement &) = delete;
    FileReplacement &operator=(const FileReplacement &) = delete;
    ~FileReplacement(); // without `finish`, `path` stays as it was

  private:
    FileReplacement() = default;

    int file_ = -1;
    std::string target_, sibling_; // empty where it is written to directly
    unsigned mode_ = 0;
};

// The same in one piece.
Status replace_file(const std::string &path, ByteView bytes);

// Says early whether `path` can be replaced: the folder exists and takes a file, `path` is no folder.
Status check_replaceable(const std::string &path);

// Signals that would end a program whose write fails (SIGPIPE, SIGXFSZ) become error returns. Call first in `main`.
void make_write_errors_returns();

// A mapped file that another process makes shorter ends the program with a line on standard error and exit code 2
// instead of SIGBUS. Call first in `main`.
void end_when_mapped_file_shrinks(std::string_view program);

// Largest resident memory of this process so far, bytes.
std::uint64_t peak_memory();

// What a child process may take; it ends where it wants more.
struct ChildLimits {
    unsigned cpu_seconds = 20;
    unsigned wall_seconds = 80;
    // Bytes of address space beyond what the caller has mapped. Not held where a sanitizer keeps its own books, nor
    // without /proc.
    std::uint64_t memory = std::uint64_t{256} << 20;
};

using ByteSink = std::function<void(ByteView)>;

struct ChildTask {
    std::string name;   // for messages: "the OBJ reader"
    std::string advice; // for messages: what to do when the child fails, "convert the scan to PLY"
    ChildLimits limits;
    std::function<Status(const ByteSink &send)> work; // runs in the child; `send` ends the child when the caller left
    std::function<Status(ByteView)> receive;          // runs in the caller: what the child sent, in order, cut anywhere
};

// Runs code that may crash, hang or take all memory in a copy of this process (fork without exec), where it sees the
// caller's memory as it was and changes only its own. Nothing of it outlives the call: no process, descriptor or core
// file, no exit handler and no buffered output of the caller's runs twice, and the child ends when the caller does.
// The child has no other descriptors than standard input (empty), output (dropped) and error (the first line becomes
// part of the message).
//
// Best called while the process has one thread. Of others the child has no copy, so that `work` may wait for a lock
// that one of them held (those of malloc and stdio are safe); it then ends at `wall_seconds`, as an error like others.
//
// errors  io         the system refuses pipes
//         memory     over a limit, killed by the system, or no child process can be had
//         bad_input  a signal, an exception, or an end before `work` returned
//         and those that `work` or `receive` return
Status run_in_child(const ChildTask &task);

} // namespace pbm
