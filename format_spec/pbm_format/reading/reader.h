// Reading .pbvg files: three calls, three promises. BVG.md section 8.
//
//   open        proves header, section table and the small sections; touches nothing else
//   directory   proves the chunk directory of a level (and of those above) when it is first needed
//   load_chunk  proves a chunk before first use: hash, masks, counts, ranges
//   view_chunk  the same for a chunk of a mapped file, once, and hands it out where it lies
//   images      proves the tile directories of the rasters; a tile proves itself when it is first looked at
//
// Each proves what it hands out. Whether the whole file is valid is asked of `verify` in checking/validate.h.
#pragma once

#include "pbm_format/chunks/chunk.h"
#include "pbm_format/chunks/mapped_chunk.h"
#include "pbm_format/container/layout.h"
#include "pbm_format/model/model.h"
#include "pbm_format/rasters/tiled_image.h"

#include <atomic>
#include <functional>
#include <memory>
#include <vector>

namespace pbm {

// Budget for decoded streams, bytes, unless the caller gives another.
inline constexpr std::uint64_t kDefaultMaxMemory = std::uint64_t{8} << 30;

class Reader {
  public:
    // `file` must stay readable and unchanged as long as the reader lives, and its first byte lie at a multiple of 8 in
    // memory, as it does in any mapping or vector. Never allocates because a field says so.
    static Result<Reader> open(ByteView file);

    const FileHeader &header() const { return header_; }
    const ModelParameters &parameters() const { return parameters_; }
    const std::vector<SectionEntry> &sections() const { return sections_; }
    int depth() const { return header_.depth; }
    // The metadata: a JSON object of at most 4 KB.
    std::string_view metadata() const;
    // The one section of this type and instance, or null.
    const SectionEntry *section(SectionType type, std::uint32_t instance = 0) const;

    // Directory of level 1..depth. The pointer stays valid as long as the reader. Not for several threads at once, but
    // while others load or view chunks of levels whose directories were read before.
    Result<const LevelDirectory *> directory(int level);

    // Level 0 as a chunk: the parent of the one chunk of level 1.
    Chunk root_chunk() const;

    // Decodes chunk `index` of `level`, whose directory was read before, into `to`. `parent` is its parent chunk
    // (shape.parent_chunk), decoded before; a chunk that was refused leaves nothing to decode those below it with.
    // Safe to call from several threads.
    Status load_chunk(int level, std::size_t index, const Chunk &parent, Chunk &to) const;

    // Chunk `index` of `level` of a mapped file, whose directory was read before, where it lies. At first touch proves
    // it and the chunks above it, and remembers; after that it costs next to nothing. What is proven holds as long as
    // the bytes stay as they are: where another process could change them, a loop over them must stay in bounds for
    // any. Safe to call from several threads.
    Result<ChunkView> view_chunk(int level, std::size_t index) const;

    // The rasters of the file, none of whose tiles is read yet. Opened anew by each call: hold on to them. They need
    // the file's bytes, not the reader.
    Result<TiledImages> images() const;
    // Rasters in the order of the file.
    std::vector<const SectionEntry *> rasters() const;

    ChunkRules chunk_rules(int level) const {
        return {.set = parameters_.attributes,
                .material_count = parameters_.materials.size(),
                .level = level,
                .finest = level == depth()};
    }

    // Stored bytes of a chunk.
    ByteView stored(const ChunkEntry &entry) const { return file_.subspan(entry.offset, entry.stored_bytes); }

  private:
    explicit Reader(ByteView file) : file_(file) {}

    // One for each chunk of a level: it was proven by view_chunk.
    using ProvenChunks = std::unique_ptr<std::atomic<bool>[]>;

    bool is_read(int level) const {
        return level >= 1 && level <= depth() && !directories_[static_cast<std::size_t>(level)].chunks.empty();
    }
    Status prove_chunk_at(int level, std::size_t index) const;

    ByteView file_;
    FileHeader header_;
    std::vector<SectionEntry> sections_;
    ModelParameters parameters_;
    std::vector<LevelDirectory> directories_; // [depth + 1]; [0] unused, without chunks where not read yet
    std::vector<ProvenChunks> proven_;        // [depth + 1]; empty if the file is not mapped
};

struct LoadOptions {
    int max_level = kMaxDepth; // levels 0..min(max_level, depth) are loaded
    int threads = 0;
    std::uint64_t max_memory = kDefaultMaxMemory; // bytes of decoded streams; more is ErrorCode::memory
};

// Bytes of all levels of all rasters.
std::uint64_t decoded_bytes(const TiledImages &images);

// The level's bricks are as many as its directory says. BVG.md 5.10.2
Status check_brick_count(const LevelDirectory &directory, const SectionEntry &bricks);

// All levels up to `max_level`, each as contiguous streams, and all rasters.
Result<Model> load_model(Reader &reader, const LoadOptions &options = {});

} // namespace pbm
