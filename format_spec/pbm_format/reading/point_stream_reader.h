// Reads a kind of point stream beside a Reader, chunk by chunk. BVG.md 19
#pragma once

#include "pbm_format/container/point_streams.h"
#include "pbm_format/reading/reader.h"

namespace pbm {

class PointStreamReader {
  public:
    // `reader` must outlive the result.
    PointStreamReader(const Reader &reader, PointStream kind);

    // Whether the file says something of points of the level.
    bool has(int level) const { return section(SectionType::stream_directory, level) != nullptr; }
    // The directory of a level; no bytes if it has none.
    FileRange directory_range(int level) const { return range_of(SectionType::stream_directory, level); }
    // The values of all chunks of a level; no bytes if it has none.
    FileRange values_range(int level) const { return range_of(SectionType::stream_values, level); }

    // Verifies and returns the directory of a level, which has one.
    Result<std::vector<PointStreamEntry>> directory(const LevelDirectory &level) const;
    // Reads it for `entry` and `load`, and drops its stored bytes; does nothing for a level without one. Not for
    // several threads at once.
    Status read_directory(const LevelDirectory &level);
    // Of a level whose directory was read before; without bytes if the stream says nothing of the chunk.
    PointStreamEntry entry(int level, std::size_t chunk) const;

    // Decodes the values of chunk `index` of `level`, whose directory was read before; `stored`: the bytes of its
    // entry, which are not none. The type of `to` is that of the reader's kind. Safe to call from several threads.
    //
    // errors  as decode_sides or decode_offsets
    Status load(int level, std::size_t index, const ChunkEntry &chunk, ByteView stored, Sides &to) const;
    Status load(int level, std::size_t index, const ChunkEntry &chunk, ByteView stored, Offsets &to) const;

  private:
    FileRange range_of(SectionType type, int level) const;
    const SectionEntry *section(SectionType type, int level) const {
        return reader_->section(type, instance_of(kind_, level));
    }

    const Reader *reader_;
    PointStream kind_;
    std::vector<std::vector<PointStreamEntry>> directories_; // [depth + 1]; empty without values, or not read yet
};

// The number of points of a level of 0..depth that have sides, or offsets: decodes these.
Result<std::uint64_t> count_sides(Reader &reader, int level);
Result<std::uint64_t> count_offsets(Reader &reader, int level);

// Loads the sides of a level of 0..depth.
Result<Sides> load_sides(Reader &reader, int level);
// Loads the sides and the offsets of all levels of a model.
Status load_point_streams(Reader &reader, Model &model);

} // namespace pbm
