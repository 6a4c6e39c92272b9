// Reading .pbvg files: three calls, three promises. BVG.md 8.
//
//   open        verifies header, section table and the small sections; touches nothing else
//   directory   verifies the chunk directory of a level (and of those above) when it is first needed
//   load_chunk  verifies a chunk before first use: hash, masks, counts, ranges
//   view_chunk  the same for a chunk of a mapped file, once, and hands it out where it lies
//   images      verifies the tile directories of the rasters; a tile verifies itself when it is first looked at
//
// A source need not be whole (system/byte_source.h): what is not there yet is asked for by range, and is no error.
//
//   opening_range, directory_range, chunk_range, brick_range     what each of these calls reads
//   chunk_bytes                                                  a chunk's bytes, or none
//
// A call whose bytes are not there is refused with ErrorCode::usage (not_there_yet) and may be made again. A call that
// may not be made, such as a chunk before its directory, is refused with ErrorCode::usage too; ranges are then empty.
//
// Each verifies what it hands out. Whether the whole file is valid is asked of `verify` in checking/validate.h.
// A model as a whole: load_model.h.
// Stability: stable.
#pragma once

#include "pbm_format/chunks/chunk.h"
#include "pbm_format/container/layout.h"
#include "pbm_format/model/model.h"
#include "system/byte_source.h"

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

namespace pbm {

struct TiledImages; // pbm_format/rasters/tiled_image.h

// Budget for decoded streams, bytes, unless the caller gives another.
inline constexpr std::uint64_t kDefaultMaxMemory = addressable(std::uint64_t{8} << 30);

class Reader {
  public:
    // A whole file must outlive the reader, as ByteSource says. Never allocates because a field says so.
    static Result<Reader> open(ByteSource file);
    static Result<Reader> open(ByteView file) { return open(ByteSource(file)); }
    // What `open` needs next of a file and is not there yet: header, section table, then the small sections. Of no
    // bytes once `open` can be called: all is there, or what is there is damaged.
    static FileRange opening_range(const ByteSource &file);

    const ByteSource &source() const { return source_; }

    const FileHeader &header() const { return header_; }
    const ModelParameters &parameters() const { return parameters_; }
    const std::vector<SectionEntry> &sections() const { return sections_; }
    int depth() const { return header_.depth; }
    // The metadata: a JSON object of at most 4 KB.
    std::string_view metadata() const {
        return {reinterpret_cast<const char *>(metadata_.bytes.data()), metadata_.bytes.size()};
    }
    // The one section of this type and instance, or null.
    const SectionEntry *section(SectionType type, std::uint32_t instance = 0) const;

    // Directory of level 1..depth. The pointer stays valid as long as the reader. Not for several threads at once, but
    // while others load or view chunks of levels whose directories were read before. Drops the stored bytes.
    Result<const LevelDirectory *> directory(int level);
    FileRange directory_range(int level) const;

    // Where chunk `index` of `level` lies, whose directory was read before: its streams, and in a mapped file its
    // bricks (else no bytes).
    FileRange chunk_range(int level, std::size_t index) const;
    FileRange brick_range(int level, std::size_t index) const;
    // These bytes; none if some of them are not there yet.
    std::optional<ChunkBytes> chunk_bytes(int level, std::size_t index) const;

    // Level 0 as a chunk: the parent of the one chunk of level 1.
    Chunk root_chunk() const;

    // Decodes chunk `index` of `level`, whose directory was read before, into `to`. `parent` is its parent chunk
    // (shape.parent_chunk), decoded before; a chunk that was refused leaves nothing to decode those below it with.
    // Safe to call from several threads.
    Status load_chunk(int level, std::size_t index, const Chunk &parent, Chunk &to) const;
    // The same from the chunk's bytes, in a packed file.
    Status load_chunk(int level, std::size_t index, const ChunkBytes &bytes, const Chunk &parent, Chunk &to) const;

    // Chunk `index` of `level` of a mapped file, whose directory was read before, where it lies. At first touch
    // verifies it and the chunks above it, and remembers; after that it costs next to nothing. What is verified holds
    // as long as the bytes stay as they are: where another process could change them, a loop over them must stay in
    // bounds for any. Where the source is not whole, nothing is remembered: the bytes of all chunks above it must be
    // there too. Safe to call from several threads.
    Result<ChunkView> view_chunk(int level, std::size_t index) const;
    // The same from the chunk's bytes, with its parent chunk as it was viewed before; null for level 1.
    Result<ChunkView> view_chunk(int level, std::size_t index, const ChunkBytes &bytes, const ChunkView *parent) const;

    ChunkRules chunk_rules(int level) const;

  private:
    explicit Reader(ByteSource file) : source_(std::move(file)) {}

    // One for each chunk of a level: it was verified by view_chunk.
    using VerifiedChunks = std::unique_ptr<std::atomic<bool>[]>;

    // Whether a caller may ask for this chunk, and in the way of this storage profile; else ErrorCode::usage.
    Status check_chunk(int level, std::size_t index, std::optional<Storage> storage = {}) const;
    bool is_read(int level) const {
        return level >= 1 && level <= depth() && !directories_[static_cast<std::size_t>(level)].chunks.empty();
    }
    const ChunkEntry &entry_of(int level, std::size_t index) const {
        return directories_[static_cast<std::size_t>(level)].chunks[index];
    }

    ByteSource source_;
    FileHeader header_;
    HeldBytes metadata_;
    std::vector<SectionEntry> sections_;
    ModelParameters parameters_;
    std::vector<LevelDirectory> directories_; // [depth + 1]; [0] unused, without chunks where not read yet
    std::vector<VerifiedChunks> verified_;    // [depth + 1]; empty unless the file is mapped and its source whole
};

// The sections that hold rasters (panorama, texture of the ground plane, lit fractions of the ground plane), in the
// order of the file. BVG.md 3.10
std::vector<const SectionEntry *> rasters(const Reader &reader);
// Headers and tile directories of all rasters: the ranges that `read_images` reads.
std::vector<FileRange> raster_ranges(const Reader &reader);

// Verifies the tile directories of all rasters. A tile is verified when it is first looked at. The images need the
// file's bytes, not the reader. Each call opens them anew.
Result<TiledImages> read_images(const Reader &reader);

} // namespace pbm
