// Reads the sides of points beside a Reader, chunk by chunk. BVG.md 19
#pragma once

#include "pbm_format/container/point_streams.h"
#include "pbm_format/reading/reader.h"

namespace pbm {

class SideReader {
  public:
    // `reader` must outlive the result.
    explicit SideReader(const Reader &reader);

    // Whether points of the level have sides.
    bool has(int level) const { return section(SectionType::stream_directory, level) != nullptr; }
    // The directory of the sides of a level; no bytes if it has none.
    FileRange directory_range(int level) const { return range_of(SectionType::stream_directory, level); }
    // The sides of all chunks of a level; no bytes if it has none.
    FileRange values_range(int level) const { return range_of(SectionType::stream_values, level); }

    // Verifies and returns the directory of the sides of a level, which has some.
    Result<std::vector<PointStreamEntry>> directory(const LevelDirectory &level) const;
    // Reads it for `entry` and `load`, and drops its stored bytes; does nothing for a level without sides. Not for
    // several threads at once.
    Status read_directory(const LevelDirectory &level);
    // Of a level whose directory was read before; without bytes if no point of the chunk has sides.
    PointStreamEntry entry(int level, std::size_t chunk) const;

    // Decodes the sides of chunk `index` of `level`, whose directory was read before; `stored`: the bytes of its entry,
    // which are not none. Safe to call from several threads.
    //
    // errors  as decode_sides
    Status load(int level, std::size_t index, const ChunkEntry &chunk, ByteView stored, Sides &to) const;

  private:
    FileRange range_of(SectionType type, int level) const;
    const SectionEntry *section(SectionType type, int level) const {
        return reader_->section(type, instance_of(PointStream::sides, level));
    }

    const Reader *reader_;
    std::vector<std::vector<PointStreamEntry>> directories_; // [depth + 1]; empty without sides, or not read yet
};

// The number of points of a level of 0..depth that have sides: decodes these.
Result<std::uint64_t> count_sides(Reader &reader, int level);

// Loads the sides of a level of 0..depth.
Result<Sides> load_sides(Reader &reader, int level);
// The same of all levels of a model.
Status load_sides(Reader &reader, Model &model);

} // namespace pbm
