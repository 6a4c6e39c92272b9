#include "pbm_format/frame.h"

#include "pbm_format/per_thread.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <memory>
#include <new>

#define ZSTD_STATIC_LINKING_ONLY // literalCompressionMode
#include <zstd.h>

namespace pbm {

namespace {

struct FreeContext {
    void operator()(ZSTD_CCtx *context) const { ZSTD_freeCCtx(context); }
    void operator()(ZSTD_DCtx *context) const { ZSTD_freeDCtx(context); }
};

// One context per thread: frames do not depend on what a context compressed before.
template <class Context, Context *create()> struct Held {
    Held() : context(create()) {
        if (!context)
            throw std::bad_alloc();
    }
    std::unique_ptr<Context, FreeContext> context;
};

ZSTD_CCtx *compression_context() { return per_thread<Held<ZSTD_CCtx, ZSTD_createCCtx>>().context.get(); }
ZSTD_DCtx *decompression_context() { return per_thread<Held<ZSTD_DCtx, ZSTD_createDCtx>>().context.get(); }

// zstd's fast mode steps over `targetLength` bytes where it finds no match: this many, and it never looks for one.
constexpr int kNoMatches = -(1 << 17);

// Returns the frame, which lies in `memory`.
ByteView compress(ByteView raw, int zstd_level, Bytes &memory) {
    ZSTD_CCtx *context = compression_context();
    ZSTD_CCtx_reset(context, ZSTD_reset_session_and_parameters);
    ZSTD_CCtx_setParameter(context, ZSTD_c_compressionLevel, zstd_level);
    ZSTD_CCtx_setParameter(context, ZSTD_c_literalCompressionMode, ZSTD_ps_enable);
    memory.resize(std::max(memory.size(), ZSTD_compressBound(raw.size()))); // never less: zeros would be written anew
    const std::size_t size = ZSTD_compress2(context, memory.data(), memory.size(), raw.data(), raw.size());
    if (ZSTD_isError(size) != 0)
        throw std::bad_alloc(); // the only way to fail with a buffer of compressBound bytes
    return ByteView(memory).first(size);
}

// Matches must save this share to be worth their slower decoding.
bool matches_pay(std::size_t with_matches, std::size_t without) { return with_matches + without / 5 < without; }

// Magic number of RFC 8878 (libraries may also read older ones), single segment (so that no window is larger than the
// content), reserved bit clear, no dictionary.
bool is_plain_frame(ByteView stored) {
    constexpr std::array<std::uint8_t, 4> kFrameMagic{0x28, 0xB5, 0x2F, 0xFD};
    constexpr unsigned kSingleSegment = 0x20, kReserved = 0x08, kDictionary = 0x03;
    return stored.size() > kFrameMagic.size() && std::equal(kFrameMagic.begin(), kFrameMagic.end(), stored.begin()) &&
           (stored[4] & (kSingleSegment | kReserved | kDictionary)) == kSingleSegment;
}

} // namespace

StoredFrame append_frame(ByteView raw, int compression_level, Bytes &out) {
    assert(compression_level >= 1 && compression_level <= 19);
    struct Frames {
        Bytes memory, other_memory;
    };
    auto &[memory, other_memory] = per_thread<Frames>();
    ByteView frame = compress(raw, kNoMatches, memory);
    if (compression_level > 1) {
        const ByteView other = compress(raw, compression_level, other_memory);
        if (matches_pay(other.size(), frame.size()))
            frame = other;
    }
    // A frame may not be larger than its raw bytes, nor expand beyond the limit readers accept.
    const bool smaller = frame.size() < raw.size() && raw.size() / kMaxExpansion <= frame.size();
    const ByteView stored = smaller ? frame : raw;
    out.insert(out.end(), stored.begin(), stored.end());
    return {.stored_bytes = static_cast<std::uint32_t>(stored.size()), .zstd = smaller};
}

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
    const std::size_t size =
        ZSTD_decompressDCtx(decompression_context(), raw.data(), raw.size(), stored.data(), stored.size());
    if (ZSTD_isError(size) != 0 || size != raw.size())
        return broken(wording, "5.6.3", offset, "the zstd frame does not decode", raw.size(),
                      ZSTD_isError(size) != 0 ? Value(ZSTD_getErrorName(size)) : Value(size));
    return {};
}

void append_planes(std::span<const Bytes> planes, int compression_level, Bytes &out) {
    const std::size_t entries = out.size();
    out.resize(entries + kPlaneEntryBytes * planes.size());
    for (std::size_t p = 0; p < planes.size(); ++p) {
        const StoredFrame frame = append_frame(planes[p], compression_level, out);
        const std::uint32_t entry = frame.stored_bytes | (frame.zstd ? 1U << 31 : 0U);
        std::memcpy(out.data() + entries + kPlaneEntryBytes * p, &entry, kPlaneEntryBytes);
    }
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
