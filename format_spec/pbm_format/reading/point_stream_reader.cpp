#include "pbm_format/reading/point_stream_reader.h"

#include "pbm_format/chunks/point_stream_chunk.h"
#include "pbm_format/container/file_rules.h"

namespace pbm {

PointStreamReader::PointStreamReader(const Reader &reader, PointStream kind)
    : reader_(&reader), kind_(kind), directories_(static_cast<std::size_t>(reader.depth()) + 1) {}

FileRange PointStreamReader::range_of(SectionType type, int level) const {
    const SectionEntry *const entry = section(type, level);
    return entry == nullptr ? FileRange{} : entry->range();
}

Result<std::vector<PointStreamEntry>> PointStreamReader::directory(const LevelDirectory &level) const {
    const SectionEntry &entry = *section(SectionType::stream_directory, level.level);
    const Result<HeldBytes> stored = reader_->source().require(entry.range());
    if (!stored)
        return stored.error();
    if (Status status = verify_hash(stored->bytes, entry); !status)
        return std::move(status).error();
    Result<std::vector<PointStreamEntry>> entries =
        decode_stream_directory(stored->bytes, level, *section(SectionType::stream_values, level.level));
    if (!entries)
        entries.error().offset += entry.offset;
    return entries;
}

Status PointStreamReader::read_directory(const LevelDirectory &level) {
    if (!has(level.level))
        return {};
    Result<std::vector<PointStreamEntry>> read = directory(level);
    if (!read)
        return std::move(read).error();
    directories_[static_cast<std::size_t>(level.level)] = std::move(*read);
    reader_->source().drop(directory_range(level.level));
    return {};
}

PointStreamEntry PointStreamReader::entry(int level, std::size_t chunk) const {
    const std::vector<PointStreamEntry> &entries = directories_[static_cast<std::size_t>(level)];
    return entries.empty() ? PointStreamEntry() : entries[chunk];
}

Status PointStreamReader::load(int level, std::size_t index, const ChunkEntry &chunk, ByteView stored,
                               Sides &to) const {
    return decode_sides(entry(level, index), stored, chunk, reader_->chunk_rules(level), to);
}

Status PointStreamReader::load(int level, std::size_t index, const ChunkEntry &chunk, ByteView stored,
                               Offsets &to) const {
    return decode_offsets(entry(level, index), stored, chunk.shape.points, reader_->chunk_rules(level).wording, to);
}

namespace {

// Calls visit(chunk, its values) for the chunks of a level of whose points a stream says something.
template <class Values, class Visit>
Status for_chunks(Reader &reader, PointStream kind, int level, const Visit &visit) {
    PointStreamReader stream(reader, kind);
    if (level == 0 || !stream.has(level))
        return {};
    const Result<const LevelDirectory *> directory = reader.directory(level);
    if (!directory)
        return directory.error();
    if (Status status = stream.read_directory(**directory); !status)
        return status;
    Values of_chunk;
    for (std::size_t i = 0; i < (*directory)->chunks.size(); ++i) {
        const PointStreamEntry entry = stream.entry(level, i);
        if (entry.raw_bytes == 0)
            continue;
        const Result<HeldBytes> stored = reader.source().require(entry.range());
        if (!stored)
            return stored.error();
        const ChunkEntry &chunk = (*directory)->chunks[i];
        if (Status status = stream.load(level, i, chunk, stored->bytes, of_chunk); !status)
            return status;
        visit(chunk, of_chunk);
    }
    return {};
}

template <class Values> Result<std::uint64_t> count_points(Reader &reader, PointStream kind, int level) {
    std::uint64_t count = 0;
    if (Status status = for_chunks<Values>(
            reader, kind, level, [&](const ChunkEntry &, const Values &of_chunk) { count += of_chunk.size(); });
        !status)
        return std::move(status).error();
    return count;
}

// Appends points of a chunk to those of its level.
void append_points(const ChunkEntry &chunk, const std::vector<std::uint32_t> &points, std::vector<std::uint32_t> &to) {
    for (const std::uint32_t point : points)
        to.push_back(static_cast<std::uint32_t>(chunk.first_point) + point);
}

} // namespace

Result<std::uint64_t> count_sides(Reader &reader, int level) {
    return count_points<Sides>(reader, PointStream::sides, level);
}
Result<std::uint64_t> count_offsets(Reader &reader, int level) {
    return count_points<Offsets>(reader, PointStream::offsets, level);
}

Result<Sides> load_sides(Reader &reader, int level) {
    Sides all;
    Status status =
        for_chunks<Sides>(reader, PointStream::sides, level, [&](const ChunkEntry &chunk, const Sides &sides) {
            append_points(chunk, sides.points, all.points);
            for_columns(
                reader.parameters().attributes,
                [](const StreamInfo &, std::size_t, auto &column, const auto &more) {
                    column.insert(column.end(), more.begin(), more.end());
                },
                all.values, sides.values);
        });
    if (!status)
        return std::move(status).error();
    return all;
}

Status load_point_streams(Reader &reader, Model &model) {
    for (std::size_t l = 1; l < model.levels.size(); ++l) {
        const int level = static_cast<int>(l);
        Result<Sides> sides = load_sides(reader, level);
        if (!sides)
            return std::move(sides).error();
        model.levels[l].sides = std::move(*sides);
        Offsets &all = model.levels[l].offsets;
        if (Status status = for_chunks<Offsets>(reader, PointStream::offsets, level,
                                                [&](const ChunkEntry &chunk, const Offsets &offsets) {
                                                    append_points(chunk, offsets.points, all.points);
                                                    all.values.insert(all.values.end(), offsets.values.begin(),
                                                                      offsets.values.end());
                                                });
            !status)
            return status;
    }
    return {};
}

} // namespace pbm
