// Decoding a whole model as a reader of everything would, and the steps that it consists of, each alone.
#pragma once

#include "pbm_format/reading/reader.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace pbm::bench {

// Opens a file and decodes all of its chunks with every check on, level by level. Chunks of the finest level are
// decoded into the same memory again and again, those above are kept until the end, since they are parents; all of it
// is reused by the next run, so that page faults are not part of what is measured.
class WholeDecoder {
  public:
    // `file` must stay as it is. threads >= 1.
    WholeDecoder(ByteView file, int threads);
    // Returns the points of the finest level, or what is wrong with the file.
    Result<std::uint64_t> run();

  private:
    void work(Reader &reader, std::size_t thread);

    ByteView file_;
    std::size_t threads_;
    std::vector<const LevelDirectory *> directories_; // [1..depth]
    std::vector<std::vector<Chunk>> kept_;            // [0..depth - 1][chunk]
    std::vector<Chunk> scratch_;                      // [thread]
    struct Shared;
    std::shared_ptr<Shared> shared_;
};

struct Step {
    std::string name;
    std::function<void()> run;
};

// The steps of decoding that can be run alone: opening with all directories, hashes, zstd stream by stream, siblings,
// filters (each with the siblings, which the whole lays out once for all). `reader` has read all of its directories;
// both must stay. One thread.
std::vector<Step> decoding_steps(ByteView file, Reader &reader, const std::vector<const LevelDirectory *> &directories);

// Opens all directories: [0] is null, then level 1..depth.
Result<std::vector<const LevelDirectory *>> open_directories(Reader &reader);

} // namespace pbm::bench
