#include "pbm_render/detail/chunk_loader.h"

#include "pbm_format/chunks/field_chunk.h"
#include "pbm_format/container/file_rules.h"
#include "pbm_format/model/octree.h"

#include <algorithm>
#include <array>
#include <bit>
#include <new>

#include <glm/common.hpp>

namespace pbm {

Box bounds_of(std::span<const BrickRecord> bricks, int level) {
    Box box{.least = glm::dvec3(1), .most = glm::dvec3(0)};
    const double edge = std::ldexp(8.0, -level);
    for (const BrickRecord &brick : bricks) {
        const glm::dvec3 corner = glm::dvec3(brick.x, brick.y, brick.z) * edge;
        box.least = glm::min(box.least, corner);
        box.most = glm::max(box.most, glm::min(corner + edge, glm::dvec3(1)));
    }
    return box;
}

namespace {

void estimate_offsets(const ChunkTask &task, const ResidentChunk &chunk) {
    const PointRun whole{.chunk = &chunk.view,
                         .entry = task.entry,
                         .level = task.place.level,
                         .last = task.entry->shape.points,
                         .offsets = &chunk.offsets};
    std::vector<VisibleBrick> seen(chunk.view.bricks.size());
    seen.resize(find_visible_bricks(RunGeometry(whole, *task.frame), *task.frame, seen));
    if (!seen.empty())
        chunk.offsets.estimate(chunk.view, seen);
}

// Writes the palette index of each point's height. The bytes of a mapped chunk may change: it stays in bounds.
void index_heights(const FieldColours &colours, const ChunkView &chunk, int level, Bytes &indices) {
    indices.assign(chunk.normals.size(), 0);
    const std::size_t axis = colours.axis;
    std::size_t node = 0, point = 0;
    for (const BrickRecord &brick : chunk.bricks)
        for (std::uint64_t map = brick.node_map; map != 0 && node < chunk.masks.size(); map &= map - 1) {
            const auto of_brick = morton_decode(static_cast<MortonCode>(std::countr_zero(map)))[axis];
            const std::uint32_t first = 8U * std::array{brick.x, brick.y, brick.z}[axis] + 2 * of_brick;
            std::array<std::uint8_t, 2> halves{};
            for (std::uint32_t half = 0; half < 2; ++half)
                halves[half] = colours.indices[std::min(stored_height(first + half, level), 65535U)];
            for (unsigned mask = chunk.masks[node++]; mask != 0 && point < indices.size(); mask &= mask - 1)
                indices[point++] = halves[static_cast<unsigned>(std::countr_zero(mask)) >> axis & 1];
        }
}

} // namespace

ChunkLoader::ChunkLoader(const Reader &reader, const FieldColours *colours, const HiddenClasses *hidden)
    : reader_(reader), sides_(reader, PointStream::sides), offsets_(reader, PointStream::offsets),
      root_(reader.root_chunk()), colours_(colours), hidden_(hidden) {
    if (colours_ != nullptr && colours_->basis == ColourBasis::field)
        read_fields_.push_back(colours_->field);
    if (hidden_ != nullptr && (read_fields_.empty() || read_fields_.front() != hidden_->field))
        read_fields_.push_back(hidden_->field);
    if (Result<FieldReader> fields = read_fields_.empty() ? Error() : FieldReader::open(reader); fields)
        fields_ = std::move(*fields);
    else
        read_fields_.clear();
}

Status ChunkLoader::begin_level(const LevelDirectory &level) {
    if (Status read = sides_.read_directory(level); !read)
        return read;
    if (Status read = offsets_.read_directory(level); !read)
        return read;
    return fields_ ? fields_->read_directory(level) : Status();
}

std::vector<FileRange> ChunkLoader::directories_wanted(int level) const {
    std::vector<FileRange> wanted{reader_.directory_range(level), sides_.directory_range(level),
                                  offsets_.directory_range(level)};
    if (fields_)
        wanted.push_back(fields_->directory_range(level));
    std::erase_if(wanted, [&](FileRange range) { return reader_.source().has(range); });
    return wanted;
}

Status ChunkLoader::load_fields(const ChunkTask &task, ResidentChunk &to) const {
    const auto [level, index] = task.place;
    for (std::size_t read = 0; read < read_fields_.size(); ++read) {
        const std::size_t number = read_fields_[read];
        const Field &field = fields_->fields()[number];
        const Bytes root = fields_->root_value(number);
        const ByteView above = level == 1
                                   ? ByteView(root)
                                   : slice(task.parent->fields[read],
                                           field.bytes * (task.entry->first_node - task.parent_entry->first_point),
                                           std::uint64_t{field.bytes} * task.entry->shape.nodes);
        if (Status status = decode_field(fields_->entry(level, index, number), field, task.bytes.fields[read].bytes,
                                         to.view.masks, above, to.fields[read]);
            !status)
            return status;
    }
    return {};
}

// Replaces the texture values, or the colours, of the chunk's points.
void ChunkLoader::colour(int level, ResidentChunk &to) const {
    if (colours_ == nullptr || colours_->basis == ColourBasis::plain)
        return;
    if (colours_->basis == ColourBasis::normal) {
        colour_normals(to.view.normals, to.field_colours);
        to.view.colours = to.field_colours;
        return;
    }
    if (colours_->basis == ColourBasis::height)
        index_heights(*colours_, to.view, level, to.field_colours);
    else if (fields_)
        index_field(*colours_, fields_->fields()[colours_->field], to.fields.front(), to.field_colours);
    to.view.textures = to.field_colours;
}

void ChunkLoader::mark(int level, ResidentChunk &to) const {
    mark_round_points(to.view, reader_.parameters(), level, to.marked);
    if (hidden_ != nullptr && fields_)
        to.hides_points = mark_hidden_points(to.view, *hidden_, to.fields[read_fields_.size() - 1], to.marked);
    if (!to.hides_points || to.sides == nullptr)
        return;
    for (std::size_t i = 0; i < to.sides->points.size(); ++i)
        if (is_hidden(to.view.normals[to.sides->points[i]]))
            to.sides->second.points.normals[i] |= kHiddenBits;
}

Status ChunkLoader::load_sides(const ChunkTask &task, ResidentChunk &to) const {
    const auto [level, index] = task.place;
    if (sides_.entry(level, index).raw_bytes == 0)
        return {};
    Sides sides;
    if (Status status = sides_.load(level, index, *task.entry, task.bytes.sides.bytes, sides); !status)
        return status;
    if (to.bricks.empty()) // of a mapped file
        to.bricks.assign(to.view.bricks.begin(), to.view.bricks.end());
    to.sides = std::make_unique<ChunkSides>();
    split_sides(std::move(sides), reader_.parameters().attributes, level, to.bricks, to.view, *to.sides);
    return {};
}

Status ChunkLoader::load_offsets(const ChunkTask &task, ResidentChunk &to) const {
    const auto [level, index] = task.place;
    if (offsets_.entry(level, index).raw_bytes == 0)
        return {};
    Offsets offsets;
    if (Status status = offsets_.load(level, index, *task.entry, task.bytes.offsets.bytes, offsets); !status)
        return status;
    to.offsets.set_stored(offsets, to.view);
    return {};
}

// Gives the second sides what `colour` gives the points.
void ChunkLoader::colour_second_sides(ResidentChunk &to) const {
    if (to.sides == nullptr || to.field_colours.empty())
        return;
    ChunkSides &sides = *to.sides;
    if (colours_->basis == ColourBasis::normal) {
        colour_normals(sides.view.normals, sides.colours);
        sides.view.colours = sides.colours;
        return;
    }
    for (const std::uint32_t point : sides.points)
        sides.colours.push_back(to.field_colours[point]);
    sides.view.textures = sides.colours;
}

Status ChunkLoader::decode(const ChunkTask &task, ResidentChunk &to) const {
    const auto [level, index] = task.place;
    const ChunkShape &shape = task.entry->shape;
    to.decoded.packs_shadows = true;
    if (Status status =
            reader_.load_chunk(level, index, task.bytes, level == 1 ? root_ : task.parent->decoded, to.decoded);
        !status)
        return status;
    const auto &[masks, points, packed_shadows, packs] = to.decoded;
    const BrickParents parents =
        level == 1 ? BrickParents{}
                   : brick_parents(*task.entry, *task.parent_entry, task.parent->bricks, task.parent->decoded.masks);
    to.bricks.resize(shape.bricks);
    if (!index_bricks(parents, shape, level, masks, points.normals, points.radii, to.bricks)) {
        const SectionEntry *section = reader_.section(SectionType::level_directory, static_cast<std::uint32_t>(level));
        return wrong_split(section->offset + index * chunk_entry_bytes(reader_.parameters().attributes), nullptr,
                           &shape);
    }
    to.view.masks = masks;
    to.view.bricks = to.bricks;
    for_columns(
        reader_.parameters().attributes,
        [](const StreamInfo &, std::size_t, auto &view, const auto &column) { view = column; }, to.view, points);
    std::copy(packed_shadows.begin(), packed_shadows.end(), to.view.shadows.begin());
    return {};
}

Result<ResidentPointer> ChunkLoader::load(ChunkTask &task) const try {
    auto chunk = std::make_shared<ResidentChunk>();
    chunk->memory = std::move(task.memory);
    if (is_mapped()) {
        Result<ChunkView> view = reader_.view_chunk(task.place.level, task.place.index, task.bytes,
                                                    task.parent == nullptr ? nullptr : &task.parent->view);
        if (!view)
            return std::move(view).error();
        chunk->view = *view;
    } else if (Status status = decode(task, *chunk); !status) {
        return std::move(status).error();
    }
    if (Status status = load_sides(task, *chunk); !status)
        return std::move(status).error();
    if (Status status = load_fields(task, *chunk); !status)
        return std::move(status).error();
    colour(task.place.level, *chunk);
    colour_second_sides(*chunk);
    mark(task.place.level, *chunk);
    if (Status status = load_offsets(task, *chunk); !status)
        return std::move(status).error();
    chunk->bounds = bounds_of(chunk->view.bricks, task.place.level);
    for (const BrickRecord &brick : chunk->view.bricks)
        chunk->largest_radius = std::max(chunk->largest_radius, brick.largest_radius);
    if (task.frame != nullptr)
        estimate_offsets(task, *chunk);
    return ResidentPointer(std::move(chunk));
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

std::uint64_t ChunkLoader::added_bytes() const {
    std::uint64_t bytes = has_round_points(reader_.parameters()) ? kRoundPointBytes
                          : hidden_ != nullptr                   ? kHiddenPointBytes
                                                                 : 0;
    for (const std::size_t number : read_fields_)
        bytes += fields_->fields()[number].bytes;
    if (colours_ != nullptr && colours_->basis != ColourBasis::plain)
        bytes += colours_->basis == ColourBasis::normal ? 3 : 1;
    return bytes;
}

std::uint64_t ChunkLoader::memory_of(ChunkPlace place, const ChunkEntry &entry) const {
    const int level = place.level;
    const AttributeSet &set = reader_.parameters().attributes;
    const ChunkShape &shape = entry.shape;
    const std::uint64_t sides = ChunkSides::memory_of(entry, set, sides_.entry(level, place.index).raw_bytes);
    const bool has_offsets = offsets_.entry(level, place.index).raw_bytes > 0;
    const std::uint64_t offsets = sides + ChunkOffsets::memory_of(shape, has_offsets) + added_bytes() * shape.points;
    if (is_mapped()) // the bytes of a whole file take no memory
        return offsets + (reader_.source().is_whole() ? 0 : bytes_read_by(entry));
    LevelDirectory alone{.level = level, .chunks = {}, .points = shape.points, .nodes = shape.nodes};
    std::uint64_t bytes = offsets + decoded_bytes(alone, set) + shape.bricks * kBrickRecordBytes;
    for (const StreamInfo &stream : streams_of(set))
        if (stream.kind == StreamKind::shadow) {
            bytes += raw_stream_bytes(stream, set, level, shape.nodes, shape.points);
            bytes -= level == reader_.depth() ? shape.points : 0; // Chunk::packs_shadows
        }
    return bytes;
}

std::optional<StoredChunk> ChunkLoader::bytes_of(ChunkPlace place) const {
    std::optional<ChunkBytes> chunk = reader_.chunk_bytes(place.level, place.index);
    std::optional<HeldBytes> sides = reader_.source().view(sides_.entry(place.level, place.index).range());
    std::optional<HeldBytes> offsets = reader_.source().view(offsets_.entry(place.level, place.index).range());
    if (!chunk || !sides || !offsets)
        return std::nullopt;
    StoredChunk stored{std::move(*chunk), {}, std::move(*sides), std::move(*offsets)};
    for (std::size_t read = 0; read < read_fields_.size(); ++read) {
        std::optional<HeldBytes> field = reader_.source().view(field_range(place, read));
        if (!field)
            return std::nullopt;
        stored.fields[read] = std::move(*field);
    }
    return stored;
}

std::array<FileRange, 4 + kReadFields> ChunkLoader::ranges_of(ChunkPlace place) const {
    std::array<FileRange, 4 + kReadFields> ranges{
        reader_.chunk_range(place.level, place.index), reader_.brick_range(place.level, place.index),
        sides_.entry(place.level, place.index).range(), offsets_.entry(place.level, place.index).range()};
    for (std::size_t read = 0; read < read_fields_.size(); ++read)
        ranges[4 + read] = field_range(place, read);
    return ranges;
}

bool ChunkLoader::has_bytes(ChunkPlace place) const {
    std::vector<FileRange> wanted;
    if (!reader_.source().is_whole())
        list_wanted(place, wanted);
    return wanted.empty();
}

void ChunkLoader::list_wanted(ChunkPlace place, std::vector<FileRange> &wanted) const {
    for (const FileRange range : ranges_of(place))
        if (!reader_.source().has(range))
            wanted.push_back(range);
}

void ChunkLoader::will_need(std::span<const MissingChunk> chunks) const {
    std::vector<FileRange> ranges;
    for (const MissingChunk &chunk : chunks)
        for (const FileRange range : ranges_of(chunk.place))
            if (range.bytes > 0)
                ranges.push_back(range);
    std::sort(ranges.begin(), ranges.end(), [](const FileRange &a, const FileRange &b) { return a.offset < b.offset; });
    // Chunks beside each other are read at once: each request is a call of the kernel.
    for (auto range = ranges.begin(); range != ranges.end();) {
        FileRange joined = *range;
        while (++range != ranges.end() && range->offset - joined.offset <= joined.bytes)
            joined.bytes = std::max(joined.bytes, range->offset - joined.offset + range->bytes);
        reader_.source().will_need(joined);
    }
}

void ChunkLoader::drop_bytes(ChunkPlace place) const {
    for (const FileRange range : ranges_of(place))
        reader_.source().drop(range);
}

std::uint64_t ChunkLoader::bytes_read_by(const ChunkEntry &entry) const {
    return entry.stored_bytes + (is_mapped() ? entry.shape.bricks * kBrickRecordBytes : 0);
}

} // namespace pbm
