// Replaces files atomically: readers see the old content or the new one, never a part.
// Stability: stable.
#pragma once

#include "system/bytes.h"
#include "system/error.h"

#include <cstdint>
#include <string>

namespace pbm {

// Whether a replaced file survives a power cut immediately afterwards. `cached` leaves the write to disk to the system,
// for files that are quickly made again, such as pictures.
enum class Durability { synced, cached };

// Writes a file piece by piece, then renames it to `path`; on failure `path` stays as it was. Steps: create a temporary
// sibling, write, fsync, rename, fsync the folder (fsync only if `synced`). Mode, owner and group of a file that is
// replaced stay as far as this process may set them. Symbolic links stay; the file that they
// name is replaced or created. Written directly: open files of this process ("-", which is standard output,
// /dev/stdout, /dev/stderr, /dev/fd/N), character devices, pipes.
//
// The sibling is `path`.pbm-1, locked, or the first such number that no process holds. A sibling that a killed process
// left is overwritten or removed by the next process that writes the same file.
class FileReplacement {
  public:
    static Result<FileReplacement> begin(const std::string &path);
    Status write(ByteView bytes);
    // Overwrites bytes written before; `offset` bytes from the start.
    //
    // errors  io  also if the file is written directly and cannot seek, as a pipe
    Status overwrite(std::uint64_t offset, ByteView bytes);
    // The name of the file until `finish`; another program may fill it under this name.
    const std::string &name_until_finished() const { return sibling_.empty() ? target_ : sibling_; }
    Status finish(Durability durability = Durability::synced); // must be the last call

    FileReplacement(FileReplacement &&other) noexcept;
    FileReplacement &operator=(FileReplacement &&) = delete;
    FileReplacement(const FileReplacement &) = delete;
    FileReplacement &operator=(const FileReplacement &) = delete;
    ~FileReplacement(); // without `finish`, `path` stays as it was

  private:
    FileReplacement() = default;

    int file_ = -1, folder_ = -1;  // the folder of both names, wherever it is moved
    std::string target_, sibling_; // `sibling_` is empty if the file is written directly
    unsigned mode_ = 0;
    static constexpr unsigned kUnchanged = ~0U;
    unsigned owner_ = kUnchanged, group_ = kUnchanged; // those of the file that is replaced
};

// The same in one call.
Status replace_file(const std::string &path, ByteView bytes, Durability durability = Durability::synced);

// Checks early whether `path` can be replaced: the folder exists and is writable, `path` is not a folder.
Status check_replaceable(const std::string &path);

} // namespace pbm
