// Entropy coding of one run of bytes: a zstd frame, or the bytes as they are. BVG.md 5.6. The only user of zstd.
#pragma once

#include "pbm_format/bytes.h"
#include "pbm_format/catalogue.h"
#include "pbm_format/error.h"
#include "pbm_format/layout.h"

namespace pbm {

struct StoredFrame {
    std::uint32_t stored_bytes = 0;
    bool zstd = false; // else the raw bytes
};

// Appends `raw` to `out` in the form that is smallest, or nearly smallest and much faster to decode: what filters leave
// is noise in which matches are rare, so a frame of nothing but Huffman-coded literals (1.5 GB/s) is preferred to one
// with matches (0.5 to 1 GB/s) unless matches save a fifth. Level 1 makes no other than Huffman frames; 2..19 try
// matches with zstd's level of that number. Deterministic for a version of zstd.
StoredFrame append_frame(ByteView raw, int compression_level, Bytes &out);

// Undoes append_frame; `raw` has the size that the file promises. `offset` is that of `stored` in the file.
//
// errors  bad_attribute  5.6.1 not one whole frame of a single segment, 5.6.2 another content size, 5.6.3 no frame
Status decode_frame(ByteView stored, bool zstd, std::span<std::uint8_t> raw, std::uint64_t offset,
                    Wording wording = Wording::full);

// Appends planes of a filter with their entries in front. BVG.md 5.8.1
void append_planes(std::span<const Bytes> planes, int compression_level, Bytes &out);

// Cuts planes apart, one after the other, each with the size that those before give it.
class PlaneCursor {
  public:
    PlaneCursor(ByteView bytes, std::size_t count) : bytes_(bytes), at_(kPlaneEntryBytes * count) {}

    // False if the next plane cannot be one of `raw_bytes`.
    bool next(std::size_t raw_bytes, ByteView &stored, bool &zstd);
    bool finished() const { return at_ == bytes_.size(); }

  private:
    ByteView bytes_;
    std::size_t at_;
    std::size_t index_ = 0;
};
Error impossible_planes(std::uint64_t offset, Wording wording = Wording::full); // 5.8.1

} // namespace pbm
