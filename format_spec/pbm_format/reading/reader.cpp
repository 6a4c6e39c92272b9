#include "pbm_format/reading/reader.h"

#include "pbm_format/container/file_rules.h"
#include "pbm_format/law/catalogue.h"
#include "system/threads/parallel.h"
#include "system/threads/per_thread.h"

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

FileRange range_of(const SectionEntry &section) { return {section.offset, section.stored_bytes}; }

Result<HeldBytes> require(const ByteSource &file, FileRange range) {
    std::optional<HeldBytes> bytes = file.view(range);
    if (!bytes)
        return not_there_yet(range);
    return std::move(*bytes);
}

// The bytes of a section, whose hash is right.
Result<HeldBytes> verify_section(const ByteSource &file, const SectionEntry &section) {
    Result<HeldBytes> stored = require(file, range_of(section));
    if (!stored)
        return stored;
    if (Status status = verify_hash(stored->bytes, section); !status)
        return std::move(status).error();
    return stored;
}

// Decodes a small section into `to` after proving its hash.
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
    const Result<HeldBytes> start = require(file, header_range(file));
    if (!start)
        return start.error();
    Result<FileHeader> header = decode_header(start->bytes, file.size());
    if (!header)
        return std::move(header).error();
    reader.header_ = *header;
    const Result<HeldBytes> table = require(file, table_range(*header));
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
        return Error{ErrorCode::usage, 0,
                     "the file has no level " + std::to_string(level) + " but 1 to " + std::to_string(depth())};
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
        source_.drop(range_of(entry));
    }
    return &directories_[static_cast<std::size_t>(level)];
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

Chunk Reader::root_chunk() const { return {.masks = {}, .points = root_points(header_.root, parameters_.attributes)}; }

FileRange Reader::directory_range(int level) const {
    return range_of(*section(SectionType::level_directory, static_cast<std::uint32_t>(level)));
}

Status Reader::check_chunk(int level, std::size_t index, std::optional<Storage> storage) const {
    const auto refuse = [](std::string text) { return Error{ErrorCode::usage, 0, std::move(text)}; };
    if (!is_read(level))
        return refuse("the directory of level " + std::to_string(level) + " was not read before its chunks");
    if (index >= directories_[static_cast<std::size_t>(level)].chunks.size())
        return refuse("level " + std::to_string(level) + " has no chunk " + std::to_string(index));
    if (storage && *storage != header_.storage())
        return refuse("chunks of packed files are loaded from their bytes, those of mapped files are viewed");
    return {};
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
    const ParentNodes parents =
        parent_nodes(entry, parent.masks, first_mask, parent.points, first_point, parameters_.attributes);
    return decode_chunk(entry, bytes.streams.bytes, chunk_rules(level), parents, to);
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

std::vector<const SectionEntry *> Reader::rasters() const {
    std::vector<const SectionEntry *> rasters;
    for (const SectionEntry &entry : sections_)
        if (is_raster(entry.type))
            rasters.push_back(&entry);
    return rasters;
}

std::vector<FileRange> Reader::raster_ranges() const {
    std::vector<FileRange> ranges;
    for (const SectionEntry *entry : rasters())
        ranges.push_back(image_directory_range(*entry));
    return ranges;
}

Result<TiledImages> Reader::images() const try {
    TiledImages images;
    for (const SectionEntry *entry : rasters()) {
        Result<ImageDirectory> directory = read_image_directory(source_, *entry, header_.storage());
        if (!directory)
            return std::move(directory).error();
        auto image =
            std::make_shared<const TiledImage>(TiledImage::open(source_, range_of(*entry), std::move(*directory)));
        if (entry->type == SectionType::panorama)
            images.panorama = std::move(image);
        else if (entry->type == SectionType::ground_texture)
            images.ground_texture = std::move(image);
        else
            images.ground_lit.push_back(std::move(image));
    }
    return images;
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

Status check_brick_count(const LevelDirectory &directory, const SectionEntry &bricks) {
    const std::uint64_t count =
        directory.chunks.empty() ? 0 : directory.chunks.back().first_brick + directory.chunks.back().shape.bricks;
    if (bricks.element_bytes == kBrickRecordBytes && bricks.count == count)
        return {};
    return broken("5.10.2", bricks.offset, "the bricks section does not hold the bricks that the directory counts",
                  std::to_string(count) + " of 24 bytes",
                  std::to_string(bricks.count) + " of " + std::to_string(bricks.element_bytes) + " bytes");
}

namespace {

// Decodes all chunks of a level into `model`, which has the level above.
Status load_level(const Reader &reader, const LevelDirectory &directory, int threads, Model &model) {
    const AttributeSet &set = model.parameters.attributes;
    const Level &above = model.levels[static_cast<std::size_t>(directory.level) - 1];
    Level &level = model.levels[static_cast<std::size_t>(directory.level)];
    // Fits: load_levels has compared it with the memory allowed.
    level.masks.resize(static_cast<std::size_t>(directory.nodes));
    level.points.resize(static_cast<std::size_t>(directory.points), set);
    const bool mapped = reader.header().storage() == Storage::mapped;
    const auto load = [&](const ChunkEntry &entry, std::size_t index, Chunk &to) -> Status {
        if (mapped) // lies in the file as a whole
            return reader.load_chunk(directory.level, index, {}, to);
        const Result<HeldBytes> stored = require(reader.source(), chunk_range(entry));
        if (!stored)
            return stored.error();
        const ParentNodes parents = parent_nodes(entry, above.masks, 0, above.points, 0, set);
        return decode_chunk(entry, stored->bytes, reader.chunk_rules(directory.level), parents, to);
    };
    std::vector<std::optional<Error>> failures(directory.chunks.size());
    std::atomic<bool> failed{false};
    parallel_for(failures.size(), threads, [&](std::size_t i) {
        if (failed)
            return;
        Chunk &chunk = per_thread<Chunk>();
        const ChunkEntry &entry = directory.chunks[i];
        const Status status = load(entry, i, chunk);
        if (status) {
            place_chunk(chunk, entry, set, level);
        } else {
            failures[i] = status.error();
            failed = true;
        }
    });
    for (std::optional<Error> &failure : failures)
        if (failure)
            return std::move(*failure);
    return {};
}

// Level 0 of all rasters.
Status load_images(const TiledImages &images, int threads, ModelImages &to) {
    Status status;
    const auto load = [&](const std::shared_ptr<const TiledImage> &image, Image &into) {
        if (!status || image == nullptr)
            return;
        Result<Image> level = image->level_image(0, threads);
        if (level)
            into = std::move(level).value();
        else
            status = std::move(level).error();
    };
    load(images.ground_texture, to.ground_texture);
    to.ground_lit.resize(images.ground_lit.size());
    for (std::size_t light = 0; light < images.ground_lit.size(); ++light)
        load(images.ground_lit[light], to.ground_lit[light]);
    load(images.panorama, to.panorama);
    return status;
}

} // namespace

std::uint64_t decoded_bytes(const TiledImages &images) {
    std::uint64_t bytes = 0;
    const auto add = [&](const std::shared_ptr<const TiledImage> &image) {
        bytes += image == nullptr ? 0 : image->grid().texel_bytes();
    };
    add(images.panorama);
    add(images.ground_texture);
    for (const auto &lit : images.ground_lit)
        add(lit);
    return bytes;
}

Result<Model> load_model(Reader &reader, const LoadOptions &options) try {
    const Result<TiledImages> images = reader.images();
    if (!images)
        return images.error();
    const AttributeSet &set = reader.parameters().attributes;
    const int last = std::min(options.max_level, reader.depth());
    std::uint64_t memory = decoded_bytes(*images);
    std::vector<const LevelDirectory *> directories{nullptr};
    for (int level = 1; level <= last; ++level) {
        const Result<const LevelDirectory *> directory = reader.directory(level);
        if (!directory)
            return directory.error();
        directories.push_back(*directory);
        memory += decoded_bytes(**directory, set);
    }
    if (memory > addressable(options.max_memory))
        return broken("system.memory", 0,
                      "the model needs " + std::to_string(memory >> 20) + " MiB of memory, more than allowed (" +
                          std::to_string(options.max_memory >> 20) + " MiB): draw a coarser level or allow more",
                      options.max_memory, memory);
    Model model;
    model.parameters = reader.parameters();
    model.metadata = reader.metadata();
    model.levels.resize(static_cast<std::size_t>(last) + 1);
    model.levels[0].points = root_points(reader.header().root, set);

    // Level by level, since chunks need their parents.
    for (int level = 1; level <= last; ++level)
        if (Status status = load_level(reader, *directories[static_cast<std::size_t>(level)], options.threads, model);
            !status)
            return std::move(status).error();
    if (Status status = load_images(*images, options.threads, model.images); !status)
        return std::move(status).error();
    return model;
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

} // namespace pbm
