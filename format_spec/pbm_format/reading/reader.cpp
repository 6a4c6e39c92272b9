#include "pbm_format/reading/reader.h"

#include "pbm_format/chunks/brick_index.h"
#include "pbm_format/chunks/mapped_chunk.h"
#include "pbm_format/chunks/stream_rules.h"
#include "pbm_format/container/file_rules.h"

#include <algorithm>
#include <atomic>
#include <new>
#include <optional>

namespace pbm {

namespace {

Error at_section(Error error, const SectionEntry &section) {
    error.offset += section.offset;
    return error;
}

// The bytes of a section, whose hash is right.
Result<HeldBytes> verify_section(const ByteSource &file, const SectionEntry &section) {
    Result<HeldBytes> stored = file.require(section.range());
    if (!stored)
        return stored;
    if (Status status = verify_hash(stored->bytes, section); !status)
        return std::move(status).error();
    return stored;
}

// Decodes a small section into `to` after verifying its hash.
template <class T, class Decode>
Status read_section(const ByteSource &file, const SectionEntry &section, T &to, Decode &&decode) {
    const Result<HeldBytes> stored = verify_section(file, section);
    if (!stored)
        return stored.error();
    auto decoded = decode(stored->bytes);
    if (!decoded)
        return at_section(std::move(decoded).error(), section);
    to = std::move(decoded).value();
    return {};
}

Status read_metadata(const ByteSource &file, const SectionEntry &section, HeldBytes &to) {
    Result<HeldBytes> stored = verify_section(file, section);
    if (!stored)
        return std::move(stored).error();
    to = std::move(stored).value();
    Status status = check_metadata(to.bytes);
    return status ? status : Status(at_section(std::move(status).error(), section));
}

FileRange header_range(const ByteSource &file) { return {0, std::min<std::uint64_t>(file.size(), kHeaderBytes)}; }

// Header and section table, as far as the file goes.
FileRange table_range(const FileHeader &header) {
    return {0, std::min(header.file_size, kHeaderBytes + header.table_count * std::uint64_t{kSectionEntryBytes})};
}

} // namespace

const SectionEntry *Reader::section(SectionType type, std::uint32_t instance) const {
    return find_section(sections_, type, instance);
}

FileRange Reader::opening_range(const ByteSource &file) {
    const std::optional<HeldBytes> start = file.view(header_range(file));
    if (!start)
        return header_range(file);
    const Result<FileHeader> header = decode_header(start->bytes, file.size());
    if (!header)
        return {};
    const std::optional<HeldBytes> table = file.view(table_range(*header));
    if (!table)
        return table_range(*header);
    const Result<std::vector<SectionEntry>> sections = decode_section_table(table->bytes, *header);
    if (!sections)
        return {};
    FileRange small{table->bytes.size(), 0};
    for (const SectionEntry &entry : *sections)
        if (is_known(entry.type) && entry.type < SectionType::level_directory)
            small.bytes = entry.offset + entry.stored_bytes - small.offset;
    return file.has(small) ? FileRange{} : small;
}

Result<Reader> Reader::open(ByteSource source) try {
    Reader reader(std::move(source));
    const ByteSource &file = reader.source_;
    const Result<HeldBytes> start = file.require(header_range(file));
    if (!start)
        return start.error();
    Result<FileHeader> header = decode_header(start->bytes, file.size());
    if (!header)
        return std::move(header).error();
    reader.header_ = *header;
    const Result<HeldBytes> table = file.require(table_range(*header));
    if (!table)
        return table.error();
    Result<std::vector<SectionEntry>> sections = decode_section_table(table->bytes, reader.header_);
    if (!sections)
        return std::move(sections).error();
    reader.sections_ = std::move(sections).value();

    ModelParameters &parameters = reader.parameters_;
    Status status = read_metadata(file, *reader.section(SectionType::metadata), reader.metadata_);
    read_small_sections(reader.header_, reader.sections_, parameters,
                        [&](const SectionEntry &entry, auto &to, const auto &decode) {
                            if (status)
                                status = read_section(file, entry, to, decode);
                            return status.ok();
                        });
    if (status)
        status = check_parameters(parameters, reader.sections_);
    if (status)
        status = check_root(reader.header_.root, parameters);
    if (status)
        status = check_point_count(reader.header_, *reader.section(SectionType::level_chunks, reader.header_.depth));
    if (!status)
        return std::move(status).error();
    const std::size_t levels = std::size_t{reader.header_.depth} + 1;
    reader.directories_.resize(levels);
    reader.verified_.resize(levels);
    return reader;
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

Result<const LevelDirectory *> Reader::directory(int level) try {
    if (level < 1 || level > depth())
        return usage_error("the file has no level " + std::to_string(level) + " but 1 to " + std::to_string(depth()));
    for (int next = 1; next <= level; ++next) {
        const auto at = static_cast<std::size_t>(next);
        if (is_read(next))
            continue;
        const SectionEntry &entry = *section(SectionType::level_directory, static_cast<std::uint32_t>(next));
        const LevelDirectory *above = next == 1 ? nullptr : &directories_[at - 1];
        LevelDirectory read;
        const Status status = read_section(source_, entry, read, [&](ByteView bytes) {
            return decode_directory(bytes, next, parameters_.attributes, header_.chunk_points, above,
                                    *section(SectionType::level_chunks, static_cast<std::uint32_t>(next)));
        });
        if (!status)
            return status.error();
        if (const Status counted = check_chunk_count(read, entry, sections_); !counted)
            return counted.error();
        VerifiedChunks verified;
        if (header_.storage() == Storage::mapped) {
            const SectionEntry &bricks = *section(SectionType::level_bricks, static_cast<std::uint32_t>(next));
            if (const Status counted = check_brick_count(read, bricks); !counted)
                return counted.error();
            if (source_.is_whole())
                verified = std::make_unique<std::atomic<bool>[]>(read.chunks.size());
        }
        directories_[at] = std::move(read);
        verified_[at] = std::move(verified);
        source_.drop(entry.range());
    }
    return &directories_[static_cast<std::size_t>(level)];
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

Chunk Reader::root_chunk() const { return {.masks = {}, .points = root_points(header_.root, parameters_.attributes)}; }

FileRange Reader::directory_range(int level) const {
    return section(SectionType::level_directory, static_cast<std::uint32_t>(level))->range();
}

Status Reader::check_chunk(int level, std::size_t index, std::optional<Storage> storage) const {
    if (!is_read(level))
        return usage_error("the directory of level " + std::to_string(level) + " was not read before its chunks");
    if (index >= directories_[static_cast<std::size_t>(level)].chunks.size())
        return usage_error("level " + std::to_string(level) + " has no chunk " + std::to_string(index));
    if (storage && *storage != header_.storage())
        return usage_error("chunks of packed files are loaded from their bytes, those of mapped files are viewed");
    return {};
}

ChunkRules Reader::chunk_rules(int level) const {
    return {.set = parameters_.attributes,
            .material_count = parameters_.materials.size(),
            .level = level,
            .finest = level == depth()};
}

FileRange Reader::chunk_range(int level, std::size_t index) const {
    return check_chunk(level, index) ? pbm::chunk_range(entry_of(level, index)) : FileRange{};
}

FileRange Reader::brick_range(int level, std::size_t index) const {
    if (!check_chunk(level, index, Storage::mapped))
        return {};
    return pbm::brick_range(entry_of(level, index),
                            *section(SectionType::level_bricks, static_cast<std::uint32_t>(level)));
}

std::optional<ChunkBytes> Reader::chunk_bytes(int level, std::size_t index) const {
    std::optional<HeldBytes> streams = source_.view(chunk_range(level, index));
    std::optional<HeldBytes> bricks = source_.view(brick_range(level, index));
    if (!streams || !bricks)
        return std::nullopt;
    return ChunkBytes{.streams = std::move(*streams), .bricks = std::move(*bricks)};
}

Status Reader::load_chunk(int level, std::size_t index, const Chunk &parent, Chunk &to) const try {
    if (Status status = check_chunk(level, index); !status)
        return status;
    if (header_.storage() == Storage::mapped) {
        const Result<ChunkView> view = view_chunk(level, index);
        if (!view)
            return view.error();
        copy_chunk(*view, parameters_.attributes, level, to);
        return {};
    }
    const std::optional<ChunkBytes> bytes = chunk_bytes(level, index);
    return bytes ? load_chunk(level, index, *bytes, parent, to) : Status(not_there_yet(chunk_range(level, index)));
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

Status Reader::load_chunk(int level, std::size_t index, const ChunkBytes &bytes, const Chunk &parent, Chunk &to) const
    try {
    if (Status status = check_chunk(level, index, Storage::packed); !status)
        return status;
    assert(&parent != &to);
    const ChunkEntry &entry = entry_of(level, index);
    std::uint64_t first_mask = 0, first_point = 0;
    if (level > 1) {
        const ChunkEntry &above = entry_of(level - 1, entry.shape.parent_chunk);
        first_mask = above.first_node;
        first_point = above.first_point;
    }
    const ChunkNodes nodes =
        chunk_nodes(entry, parent.masks, first_mask, parent.points, first_point, parameters_.attributes);
    return decode_chunk(entry, bytes.streams.bytes, chunk_rules(level), nodes, to);
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

Result<ChunkView> Reader::view_chunk(int level, std::size_t index) const try {
    if (Status status = check_chunk(level, index, Storage::mapped); !status)
        return std::move(status).error();
    // Up to the first ancestor that is verified, and down again.
    std::array<std::size_t, kMaxDepth + 1> path{};
    int verified = level;
    path[static_cast<std::size_t>(level)] = index;
    for (; verified > 1; --verified) {
        const auto at = static_cast<std::size_t>(verified);
        if (verified_[at] && verified_[at][path[at]].load(std::memory_order_acquire))
            break;
        path[at - 1] = entry_of(verified, path[at]).shape.parent_chunk;
    }
    ChunkView parent;
    for (int next = verified;; ++next) {
        const std::size_t at = path[static_cast<std::size_t>(next)];
        const std::optional<ChunkBytes> bytes = chunk_bytes(next, at);
        if (!bytes)
            return not_there_yet(chunk_range(next, at));
        Result<ChunkView> view = view_chunk(next, at, *bytes, next == 1 ? nullptr : &parent);
        if (!view || next == level)
            return view;
        parent = std::move(view).value();
    }
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

Result<ChunkView> Reader::view_chunk(int level, std::size_t index, const ChunkBytes &bytes,
                                     const ChunkView *parent) const try {
    if (Status status = check_chunk(level, index, Storage::mapped); !status)
        return std::move(status).error();
    const VerifiedChunks &verified = verified_[static_cast<std::size_t>(level)];
    const ChunkEntry &entry = entry_of(level, index);
    if (!verified || !verified[index].load(std::memory_order_acquire)) {
        BrickParents parents;
        if (parent != nullptr)
            parents =
                brick_parents(entry, entry_of(level - 1, entry.shape.parent_chunk), parent->bricks, parent->masks);
        const SectionEntry &bricks = *section(SectionType::level_bricks, static_cast<std::uint32_t>(level));
        if (Status status = verify_chunk(entry, bytes, bricks, chunk_rules(level), parents); !status)
            return std::move(status).error();
        if (verified)
            verified[index].store(true, std::memory_order_release);
    }
    return pbm::view_chunk(entry, bytes, parameters_.attributes, level);
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

} // namespace pbm
