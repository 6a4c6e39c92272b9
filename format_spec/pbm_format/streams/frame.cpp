#include "pbm_format/streams/frame.h"

#include "system/threads/per_thread.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <memory>
#include <new>

#include <zstd.h>

namespace pbm {

namespace {

// One context per thread.
struct DecompressionContext {
    DecompressionContext() : context(ZSTD_createDCtx(), ZSTD_freeDCtx) {
        if (!context)
            throw std::bad_alloc();
    }
    std::unique_ptr<ZSTD_DCtx, std::size_t (*)(ZSTD_DCtx *)> context;
};

// Requires the magic number of RFC 8878 (libraries may also read older ones), a single segment (so that the window is
// no larger than the content), a clear reserved bit, and no dictionary.
bool is_plain_frame(ByteView stored) {
    constexpr std::array<std::uint8_t, 4> kFrameMagic{0x28, 0xB5, 0x2F, 0xFD};
    constexpr unsigned kSingleSegment = 0x20, kReserved = 0x08, kDictionary = 0x03;
    return stored.size() > kFrameMagic.size() && std::equal(kFrameMagic.begin(), kFrameMagic.end(), stored.begin()) &&
           (stored[4] & (kSingleSegment | kReserved | kDictionary)) == kSingleSegment;
}

} // namespace

Status decode_frame(ByteView stored, bool zstd, std::span<std::uint8_t> raw, std::uint64_t offset, Wording wording) {
    if (!zstd) {
        assert(stored.size() == raw.size());
        std::copy(stored.begin(), stored.end(), raw.begin());
        return {};
    }
    const std::size_t frame_bytes = ZSTD_findFrameCompressedSize(stored.data(), stored.size());
    if (!is_plain_frame(stored) || ZSTD_isError(frame_bytes) != 0 || frame_bytes != stored.size())
        return broken(wording, "5.6.1", offset, "the stream is not one whole zstd frame of a single segment");
    const unsigned long long announced = ZSTD_getFrameContentSize(stored.data(), stored.size());
    if (announced != raw.size())
        return broken(wording, "5.6.2", offset, "the zstd frame does not announce the raw size", raw.size(),
                      announced == ZSTD_CONTENTSIZE_UNKNOWN ? Value("no size") : Value(announced));
    const std::size_t size = ZSTD_decompressDCtx(per_thread<DecompressionContext>().context.get(), raw.data(),
                                                 raw.size(), stored.data(), stored.size());
    if (ZSTD_isError(size) != 0 || size != raw.size())
        return broken(wording, "5.6.3", offset, "the zstd frame does not decode", raw.size(),
                      ZSTD_isError(size) != 0 ? Value(ZSTD_getErrorName(size)) : Value(size));
    return {};
}

Error impossible_planes(std::uint64_t offset, Wording wording) {
    return broken(wording, "5.8.1", offset, "the sizes of the filter's planes are impossible");
}

bool PlaneCursor::next(std::size_t raw_bytes, ByteView &stored, bool &zstd) {
    std::uint32_t entry = 0;
    std::memcpy(&entry, bytes_.data() + kPlaneEntryBytes * index_++, kPlaneEntryBytes);
    const std::size_t size = entry & 0xFFFFFF;
    zstd = entry >> 31 != 0;
    if ((entry & 0x7F000000) != 0 || size > bytes_.size() - at_ || (zstd ? size >= raw_bytes : size != raw_bytes))
        return false;
    stored = bytes_.subspan(at_, size);
    at_ += size;
    return true;
}

} // namespace pbm
