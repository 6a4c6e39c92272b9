// Assembles resident chunks: decodes a chunk of a packed file and lists its bricks, or views a chunk of a mapped file.
#pragma once

#include "pbm_format/reading/field_reader.h"
#include "pbm_format/reading/point_stream_reader.h"
#include "pbm_format/reading/reader.h"
#include "pbm_render/appearance/field_colours.h"
#include "pbm_render/appearance/hidden_classes.h"
#include "pbm_render/bricks/frame_geometry.h"
#include "pbm_render/detail/detail_view.h"
#include "pbm_render/detail/resident_chunk.h"

namespace pbm {

// The picture that chunks are loaded for.
using FramePointer = std::shared_ptr<const FrameGeometry>;

// The stored bytes of a chunk.
struct StoredChunk : ChunkBytes {
    std::array<HeldBytes, kReadFields> fields;
    HeldBytes sides, offsets;
};

struct ChunkTask {
    ChunkPlace place;
    const ChunkEntry *entry = nullptr;
    const ChunkEntry *parent_entry = nullptr; // null for level 1
    ResidentPointer parent;                   // null for level 1
    MemoryClaim memory;                       // memory_of(place, *entry); the chunk takes it over
    StoredChunk bytes;                        // bytes_of(place)
    FramePointer frame;                       // the picture that shows it as a whole, or null
};

class ChunkLoader {
  public:
    // `reader` must outlive the loader and must have read the directories of the levels that are loaded. `colours`:
    // what points show in place of their own, or null; `hidden`: the points that are left out, or null. The file has
    // their fields, and the source its section of fields. Thread-safe.
    explicit ChunkLoader(const Reader &reader, const FieldColours *colours = nullptr,
                         const HiddenClasses *hidden = nullptr);

    bool reads_fields() const { return fields_.has_value(); }

    // Reads what the loading of a level needs beside its directory.
    Status begin_level(const LevelDirectory &level);
    // The directories of a level that the source lacks.
    std::vector<FileRange> directories_wanted(int level) const;

    // Estimates the surface offsets of the bricks that task.frame shows, so that no frame waits for them.
    //
    // errors  as Reader::load_chunk; bad_directory: the chunk does not hold whole bricks below its root; memory
    Result<ResidentPointer> load(ChunkTask &task) const;

    // Bytes that a chunk takes while it is resident, with surface offsets for all of its points.
    std::uint64_t memory_of(ChunkPlace place, const ChunkEntry &entry) const;
    // The stored bytes of a chunk; empty if the source lacks some of them.
    std::optional<StoredChunk> bytes_of(ChunkPlace place) const;
    bool has_bytes(ChunkPlace place) const;
    // Appends those ranges of the chunk in the file that the source lacks.
    void list_wanted(ChunkPlace place, std::vector<FileRange> &wanted) const;
    // Starts to read the bytes of chunks, so that several are read at a time.
    void will_need(std::span<const MissingChunk> chunks) const;
    // Drops the chunk's bytes from the source; a task has its own.
    void drop_bytes(ChunkPlace place) const;

    // Bytes of the file that `load` reads.
    std::uint64_t bytes_read_by(const ChunkEntry &entry) const;
    // Points that `load` decodes: 0 in a mapped file.
    std::uint64_t points_decoded_by(const ChunkEntry &entry) const { return is_mapped() ? 0 : entry.shape.points; }

  private:
    bool is_mapped() const { return reader_.header().storage() == Storage::mapped; }
    Status decode(const ChunkTask &task, ResidentChunk &to) const;
    Status load_fields(const ChunkTask &task, ResidentChunk &to) const;
    void colour(int level, ResidentChunk &to) const;
    void mark(int level, ResidentChunk &to) const;
    Status load_sides(const ChunkTask &task, ResidentChunk &to) const;
    Status load_offsets(const ChunkTask &task, ResidentChunk &to) const;
    void colour_second_sides(ResidentChunk &to) const;
    // Bytes of a point beside its streams: stored values of fields, colours, marks.
    std::uint64_t added_bytes() const;
    FileRange field_range(ChunkPlace place, std::size_t read) const {
        return fields_->entry(place.level, place.index, read_fields_[read]).range();
    }
    // Of its streams, its bricks, its sides, its offsets and its fields; no bytes where there are none.
    std::array<FileRange, 4 + kReadFields> ranges_of(ChunkPlace place) const;

    const Reader &reader_;
    PointStreamReader sides_, offsets_;
    const Chunk root_; // the parent of level 1
    const FieldColours *colours_;
    const HiddenClasses *hidden_;
    std::optional<FieldReader> fields_;    // if a field is read
    std::vector<std::size_t> read_fields_; // at most kReadFields: first that of the colours, if they are of one
};

} // namespace pbm
