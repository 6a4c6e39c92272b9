// Files that are replaced atomically: readers see the old content or the new one, never a part.
#pragma once

#include "system/bytes.h"
#include "system/error.h"

#include <cstdint>
#include <string>

namespace pbm {

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

} // namespace pbm
