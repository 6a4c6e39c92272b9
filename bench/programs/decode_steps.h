// Decoding a whole model, and each of its steps alone.
#pragma once

#include "pbm_format/reading/reader.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace pbm::bench {

// Opens a file and decodes all of its chunks with every check, level by level. Chunks of the finest level share one
// buffer per thread; the others are parents and are kept until the end. The next run reuses all memory, so that page
// faults are not measured.
class WholeDecoder {
  public:
    // `file` must stay unchanged and outlive this object. threads >= 1.
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

// Steps of decoding that can run alone: opening with all directories, hashes, zstd per stream, layout of siblings,
// filters (each includes the layout, which whole decoding makes once). `reader` has read all of its directories.
// `file` and `reader` must outlive the steps. One thread.
std::vector<Step> decoding_steps(ByteView file, Reader &reader, const std::vector<const LevelDirectory *> &directories);

// Opens all directories: [0] is null, then level 1..depth.
Result<std::vector<const LevelDirectory *>> open_directories(Reader &reader);

} // namespace pbm::bench
