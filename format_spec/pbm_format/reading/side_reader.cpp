#include "pbm_format/reading/side_reader.h"

#include "pbm_format/chunks/side_chunk.h"
#include "pbm_format/container/file_rules.h"

namespace pbm {

SideReader::SideReader(const Reader &reader)
    : reader_(&reader), directories_(static_cast<std::size_t>(reader.depth()) + 1) {}

FileRange SideReader::range_of(SectionType type, int level) const {
    const SectionEntry *const entry = section(type, level);
    return entry == nullptr ? FileRange{} : entry->range();
}

Result<std::vector<PointStreamEntry>> SideReader::directory(const LevelDirectory &level) const {
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

Status SideReader::read_directory(const LevelDirectory &level) {
    if (!has(level.level))
        return {};
    Result<std::vector<PointStreamEntry>> read = directory(level);
    if (!read)
        return std::move(read).error();
    directories_[static_cast<std::size_t>(level.level)] = std::move(*read);
    reader_->source().drop(directory_range(level.level));
    return {};
}

PointStreamEntry SideReader::entry(int level, std::size_t chunk) const {
    const std::vector<PointStreamEntry> &entries = directories_[static_cast<std::size_t>(level)];
    return entries.empty() ? PointStreamEntry() : entries[chunk];
}

Status SideReader::load(int level, std::size_t index, const ChunkEntry &chunk, ByteView stored, Sides &to) const {
    return decode_sides(entry(level, index), stored, chunk, reader_->chunk_rules(level), to);
}

namespace {

// Calls visit(chunk, its sides) for the chunks of a level that have some.
template <class Visit> Status for_sides(Reader &reader, int level, const Visit &visit) {
    SideReader sides(reader);
    if (level == 0 || !sides.has(level))
        return {};
    const Result<const LevelDirectory *> directory = reader.directory(level);
    if (!directory)
        return directory.error();
    if (Status status = sides.read_directory(**directory); !status)
        return status;
    Sides of_chunk;
    for (std::size_t i = 0; i < (*directory)->chunks.size(); ++i) {
        const PointStreamEntry entry = sides.entry(level, i);
        if (entry.raw_bytes == 0)
            continue;
        const Result<HeldBytes> stored = reader.source().require(entry.range());
        if (!stored)
            return stored.error();
        const ChunkEntry &chunk = (*directory)->chunks[i];
        if (Status status = sides.load(level, i, chunk, stored->bytes, of_chunk); !status)
            return status;
        visit(chunk, of_chunk);
    }
    return {};
}

} // namespace

Result<std::uint64_t> count_sides(Reader &reader, int level) {
    std::uint64_t count = 0;
    if (Status status =
            for_sides(reader, level, [&](const ChunkEntry &, const Sides &sides) { count += sides.size(); });
        !status)
        return std::move(status).error();
    return count;
}

Result<Sides> load_sides(Reader &reader, int level) {
    Sides all;
    Status status = for_sides(reader, level, [&](const ChunkEntry &chunk, const Sides &sides) {
        for (const std::uint32_t point : sides.points)
            all.points.push_back(static_cast<std::uint32_t>(chunk.first_point) + point);
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

Status load_sides(Reader &reader, Model &model) {
    for (std::size_t level = 1; level < model.levels.size(); ++level) {
        Result<Sides> sides = load_sides(reader, static_cast<int>(level));
        if (!sides)
            return std::move(sides).error();
        model.levels[level].sides = std::move(*sides);
    }
    return {};
}

} // namespace pbm
