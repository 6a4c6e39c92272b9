#include "pbm_format/writing/frame_encoder.h"

#include "pbm_format/container/layout.h"
#include "system/threads/per_thread.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <memory>
#include <new>

#define ZSTD_STATIC_LINKING_ONLY // literalCompressionMode
#include <zstd.h>

namespace pbm {

namespace {

// One context per thread; frames do not depend on earlier ones.
struct CompressionContext {
    CompressionContext() : context(ZSTD_createCCtx(), ZSTD_freeCCtx) {
        if (!context)
            throw std::bad_alloc();
    }
    std::unique_ptr<ZSTD_CCtx, std::size_t (*)(ZSTD_CCtx *)> context;
};

// zstd's fast mode skips `targetLength` bytes where it finds no match: with this level it never searches.
constexpr int kNoMatches = -(1 << 17);

// Compresses `raw` into `memory` and returns the frame there.
ByteView compress(ByteView raw, int zstd_level, Bytes &memory) {
    ZSTD_CCtx *context = per_thread<CompressionContext>().context.get();
    ZSTD_CCtx_reset(context, ZSTD_reset_session_and_parameters);
    ZSTD_CCtx_setParameter(context, ZSTD_c_compressionLevel, zstd_level);
    ZSTD_CCtx_setParameter(context, ZSTD_c_literalCompressionMode, ZSTD_ps_enable);
    memory.resize(std::max(memory.size(), ZSTD_compressBound(raw.size()))); // does not shrink: growing zeroes it
    const std::size_t size = ZSTD_compress2(context, memory.data(), memory.size(), raw.data(), raw.size());
    if (ZSTD_isError(size) != 0)
        throw std::bad_alloc(); // the only possible error with a buffer of compressBound bytes
    return ByteView(memory).first(size);
}

// Whether matches save enough to justify slower decoding: a fifth.
bool matches_pay(std::size_t with_matches, std::size_t without) { return with_matches + without / 5 < without; }

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
    // A frame must be smaller than its raw bytes, and within the expansion limit of readers.
    const bool smaller = frame.size() < raw.size() && raw.size() / kMaxExpansion <= frame.size();
    const ByteView stored = smaller ? frame : raw;
    out.insert(out.end(), stored.begin(), stored.end());
    return {.stored_bytes = static_cast<std::uint32_t>(stored.size()), .zstd = smaller};
}

std::string zstd_version() { return ZSTD_versionString(); }

void append_planes(std::span<const Bytes> planes, int compression_level, Bytes &out) {
    const std::size_t entries = out.size();
    out.resize(entries + kPlaneEntryBytes * planes.size());
    for (std::size_t p = 0; p < planes.size(); ++p) {
        const StoredFrame frame = append_frame(planes[p], compression_level, out);
        const std::uint32_t entry = frame.stored_bytes | (frame.zstd ? 1U << 31 : 0U);
        std::memcpy(out.data() + entries + kPlaneEntryBytes * p, &entry, kPlaneEntryBytes);
    }
}

} // namespace pbm
