// The points of a LAS or LAZ file, as the records of a LAS file, batch by batch.
#pragma once

#include "pbm_scan/las/laz_layout.h"

#include <vector>

namespace pbm::build {

class LasRecords {
  public:
    // `file` must outlive the result. Of LAZ it reads the table of chunks, but decodes nothing. `threads`: of next(),
    // as ReadOptions has them.
    //
    // errors  bad_input            fewer points than the header announces; damaged; announced points that cannot be
    //                              in a file of this size
    //         too_large            more than kMaxVertices points
    //         unsupported_feature  a kind of LAZ that is not known
    static Result<LasRecords> open(ByteView file, const LasHeader &header, int threads);

    // Points of the file: of the chunks of a LAZ file if they say it, else the header's.
    std::uint64_t count() const { return count_; }

    // Bytes of a LAS file behind its points where the header says that there is nothing.
    std::size_t bytes_behind() const { return bytes_behind_; }

    // The next records, count() in all; empty behind the last. They are valid until the next call.
    //
    // errors  bad_input  a chunk is damaged
    Result<ByteView> next();

  private:
    explicit LasRecords(ByteView file, int threads) : file_(file), threads_(threads) {}
    Status find_records(const LasHeader &header);
    Status find_chunks(const LasHeader &header);
    Status decode_batch();

    ByteView file_;
    int threads_;
    std::uint64_t count_ = 0;
    std::size_t bytes_behind_ = 0;
    ByteView records_; // of LAS, that next() has not returned
    LazLayout layout_;
    std::vector<LazChunk> chunks_;
    std::size_t next_chunk_ = 0;    // to decode
    std::vector<Bytes> batch_;      // decoded chunks
    std::size_t next_in_batch_ = 0; // to return
};

} // namespace pbm::build
