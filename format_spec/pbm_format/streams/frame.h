// Decodes one run of bytes: a zstd frame, or raw bytes. BVG.md 5.6. The only user of zstd's decoder.
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_format/law/catalogue.h"
#include "system/bytes.h"
#include "system/error.h"

namespace pbm {

// Decodes the output of append_frame; `raw` has the expected size. `offset` is that of `stored` in the file.
//
// errors  bad_attribute  5.6.1 not one whole frame of a single segment, 5.6.2 another content size, 5.6.3 no frame
Status decode_frame(ByteView stored, bool zstd, std::span<std::uint8_t> raw, std::uint64_t offset,
                    Wording wording = Wording::full);

// Splits a filtered stream into planes, in order; earlier planes determine the sizes of later ones.
class PlaneCursor {
  public:
    PlaneCursor(ByteView bytes, std::size_t count) : bytes_(bytes), at_(kPlaneEntryBytes * count) {}

    // Returns false if the next plane cannot have `raw_bytes` bytes.
    bool next(std::size_t raw_bytes, ByteView &stored, bool &zstd);
    bool finished() const { return at_ == bytes_.size(); }

  private:
    ByteView bytes_;
    std::size_t at_;
    std::size_t index_ = 0;
};
Error impossible_planes(std::uint64_t offset, Wording wording = Wording::full); // 5.8.1

} // namespace pbm
