// A simulated remote file: only fetched ranges are available.
#pragma once

#include "pbm_format/rasters/tiled_image.h"
#include "pbm_format/reading/reader.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <memory>

namespace pbm::test {

class NetworkFile {
  public:
    // `file` outlives this.
    explicit NetworkFile(ByteView file) : file_(file), sparse_(std::make_shared<SparseFile>(file.size())) {}

    ByteSource source() const { return ByteSource(sparse_); }
    SparseFile &sparse() const { return *sparse_; }

    void fetch(FileRange range) {
        sparse_->fill(range.offset, slice(file_, range.offset, range.bytes));
        ++ranges_;
        bytes_ += range.bytes;
    }
    void fetch(const std::vector<FileRange> &ranges) {
        for (const FileRange &range : ranges)
            fetch(range);
    }

    // Fetches what the reader needs until it is open, and the directories of the rasters.
    Reader open() {
        for (FileRange range = Reader::opening_range(source()); range.bytes > 0;
             range = Reader::opening_range(source()))
            fetch(range);
        Reader reader = value_of(Reader::open(source()));
        fetch(raster_ranges(reader));
        return reader;
    }

    std::size_t ranges() const { return ranges_; }
    std::uint64_t bytes() const { return bytes_; } // fetched so far

  private:
    ByteView file_;
    std::shared_ptr<SparseFile> sparse_;
    std::size_t ranges_ = 0;
    std::uint64_t bytes_ = 0;
};

} // namespace pbm::test
