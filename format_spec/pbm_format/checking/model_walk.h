// The part of a check that needs the points: decodes each chunk of a model once, depth first, and keeps of it what the
// rules of the whole model need. Memory is bounded by the directories and by the chunks in flight, not by the points.
#pragma once

#include "pbm_format/checking/advice.h"
#include "pbm_format/checking/tree_rules.h"
#include "pbm_format/chunks/chunk_walk.h"
#include "pbm_format/chunks/mapped_chunk.h"
#include "pbm_format/container/point_streams.h"
#include "pbm_format/hashes/unordered_hash.h"
#include "pbm_format/law/catalogue.h"

#include <atomic>

namespace pbm {

// A file whose small sections and directories are known.
struct OpenedFile {
    ByteView bytes;
    FileHeader header;
    std::vector<SectionEntry> sections;
    ModelParameters parameters;
    std::vector<LevelDirectory> directories;       // [depth + 1]; [0] is empty
    FieldTable fields;                             // without fields: empty
    std::vector<FieldDirectory> field_directories; // [depth + 1], as many as are valid
    // [place in kPointStreams][depth + 1]; empty without values
    std::array<std::vector<std::vector<PointStreamEntry>>, kPointStreams.size()> stream_directories;

    auto &streams(PointStream kind) { return stream_directories[kind == PointStream::sides ? 0 : 1]; }
    const auto &streams(PointStream kind) const { return stream_directories[kind == PointStream::sides ? 0 : 1]; }
    const SectionEntry &section(SectionType type, std::uint32_t instance = 0) const {
        return *find_section(sections, type, instance);
    }
    ByteView stored(FileRange range) const { return slice(bytes, range.offset, range.bytes); }
    ByteView stored(const SectionEntry &entry) const { return stored(entry.range()); }
};

struct ModelWalkOptions {
    int threads = 0;
    std::uint64_t max_memory = 0; // bytes
    bool stops_at_fault = false;  // only the first refused chunk is asked for
    bool whole_rules = true;      // fields are decoded, and rules of the whole model are checked
    bool averages = false;        // are checked
    bool advice = false;          // is gathered
    bool root_wrong = false;
    std::uint64_t raster_text = 0;   // bytes that rasters add to the text of content_id, after the points
    std::uint64_t raster_memory = 0; // bytes of the largest raster, decoded
};

// What a text that is hashed consists of, besides what the chunks hold, and where in it the parts of a level lie.
struct ContentPlaces {
    std::vector<std::uint64_t> masks;                    // [level]
    std::array<std::uint64_t, kMaxStreams> streams{};    // in the order of point_streams()
    std::vector<std::pair<std::uint64_t, Bytes>> others; // place and bytes
    std::uint64_t rasters = 0;                           // where they begin
};

class ModelWalk {
  public:
    // `file` must outlive the walk.
    ModelWalk(const OpenedFile &file, const ModelWalkOptions &options);

    // The least memory, bytes, that `run` and the rasters after it need. The caller compares it with `max_memory`.
    std::uint64_t min_memory() const;

    // Decodes all chunks and checks them.
    void run();

    struct Refusal {
        std::size_t chunk;
        const CatalogueEntry *entry;
    };
    const std::vector<Refusal> &refused(int level) const { return refused_[static_cast<std::size_t>(level)]; }
    // The error of a refused chunk, in full; ok if another process has changed the bytes since.
    Status explain(int level, std::size_t chunk);
    bool complete() const { return is_whole_; } // nothing was refused
    std::uint64_t chunks() const { return chunks_; }
    std::uint64_t points() const { return points_; }

    // Refused values of fields of the first level that has some.
    struct FieldRefusal {
        std::size_t chunk;
        Error error;
    };
    int level_of_refused_fields() const { return refused_fields_level_; }
    const std::vector<FieldRefusal> &refused_fields() const { return refused_fields_; }

    // Of a complete model.
    std::vector<std::vector<ChunkShape>> split() { return tree_.split(); }
    WrongAverages &wrong_averages() { return tree_.wrong(); }
    const UsedParameters &used() const { return used_; }
    const std::vector<LooseCone> &loose_cones() const { return loose_cones_; }

    // The text of content_id. Rasters are added by the caller, from raster_place on, in each round.
    UnorderedHash &content() { return *content_; }
    std::uint64_t raster_place() const { return places_.rasters; }
    // Where there is not enough memory for the hashes: adds everything again that the next round of them needs.
    bool run_again();
    Hash128 fields_id() const { return fields_->finish(); }

  private:
    static constexpr std::uint64_t kMinHashMemory = 4096;

    // What is kept of a chunk. Chunks of the finest level keep no streams.
    struct ChunkData {
        Chunk chunk{};
        std::vector<Bytes> fields{};
        const CatalogueEntry *refusal = nullptr;
        std::optional<Error> fields_error{};
        NormalCone narrowest{};
        UsedParameters used{};
        MeasuredSubtree subtree{};
    };
    using Walked = WalkedChunk<ChunkData>;

    std::uint64_t memory(std::size_t batch, std::size_t threads) const;
    void measure();
    WalkLimits choose_limits(std::uint64_t max_memory) const;
    void place_content();
    bool is_finest(const Walked &chunk) const { return chunk.level == file_.header.depth; }
    Walked root() const;
    void walk();

    bool load(Walked &chunk);
    Status decode(const ChunkEntry &entry, const Walked &above, int level, Wording wording, Chunk &to) const;
    Status load_mapped(const ChunkEntry &entry, const ChunkRules &rules, Chunk &to) const;
    ChunkBytes stored_chunk(const ChunkEntry &entry, int level) const;
    bool hash_needs(const Walked &chunk) const;
    void hash(const Walked &chunk, const Chunk &decoded, const std::vector<Bytes> &fields);
    void load_fields(Walked &chunk, const Chunk &decoded, std::vector<Bytes> &to);
    void gather_advice(Walked &chunk, const Chunk &decoded) const;
    ChunkPath path_to(const Walked &chunk, const Chunk &decoded, std::span<const Bytes> fields) const;
    bool has_sides(const Walked &chunk) const;
    bool take(std::span<Walked> chunks);

    const OpenedFile &file_;
    ModelWalkOptions options_;
    std::uint64_t fixed_ = 0;                // bytes of the directories
    std::vector<std::uint64_t> chunk_bytes_; // [level]: of the largest chunk, decoded
    std::uint64_t result_bytes_ = 0;         // of what is kept of a chunk of the finest level
    TreeContext context_;
    TreeRules tree_;
    ContentPlaces places_;
    std::vector<std::uint64_t> field_places_; // [fields], in the text of fields_id
    std::uint64_t fields_text_ = 0;           // bytes of that text
    std::unique_ptr<UnorderedHash> content_, fields_;
    std::optional<ChunkWalk<ChunkData>> walk_;
    bool again_ = false; // everything was checked before

    std::atomic<bool> is_whole_{true}, fields_whole_{true}; // nothing was refused so far
    int last_level_;                                        // that is asked for
    std::vector<std::vector<Refusal>> refused_;             // [level]
    std::vector<FieldRefusal> refused_fields_;
    int refused_fields_level_ = kMaxDepth + 1;
    std::uint64_t chunks_ = 0, points_ = 0;
    UsedParameters used_;
    std::vector<LooseCone> loose_cones_;
    std::vector<Walked> explained_; // [level]: chunks above the last one that was explained
};

} // namespace pbm
