#include "pbm_render/detail/chunk_loader.h"

#include "pbm_format/chunks/field_chunk.h"
#include "pbm_format/container/file_rules.h"

#include <algorithm>
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

} // namespace

ChunkLoader::ChunkLoader(const Reader &reader, const FieldColours *colours)
    : reader_(reader), root_(reader.root_chunk()), colours_(colours) {
    if (Result<FieldReader> fields = colours_ == nullptr ? Error() : FieldReader::open(reader); fields)
        fields_ = std::move(*fields);
}

Status ChunkLoader::begin_level(const LevelDirectory &level) {
    return fields_ ? fields_->read_directory(level) : Status();
}

std::vector<FileRange> ChunkLoader::directories_wanted(int level) const {
    std::vector<FileRange> wanted{reader_.directory_range(level)};
    if (fields_)
        wanted.push_back(fields_->directory_range(level));
    std::erase_if(wanted, [&](FileRange range) { return reader_.source().has(range); });
    return wanted;
}

// A point's index in the colour map takes the place of its texture value.
Status ChunkLoader::load_field(const ChunkTask &task, ResidentChunk &to) const {
    const auto [level, index] = task.place;
    const std::size_t number = colours_->field;
    const Field &field = fields_->fields()[number];
    const Bytes root = fields_->root_value(number);
    const ByteView above =
        level == 1 ? ByteView(root)
                   : slice(task.parent->field, field.bytes * (task.entry->first_node - task.parent_entry->first_point),
                           std::uint64_t{field.bytes} * task.entry->shape.nodes);
    if (Status status = decode_field(fields_->entry(level, index, number), field, task.bytes.field.bytes, to.view.masks,
                                     above, to.field);
        !status)
        return status;
    index_field(*colours_, field, to.field, to.field_indices);
    to.view.textures = to.field_indices;
    return {};
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
    if (fields_)
        if (Status status = load_field(task, *chunk); !status)
            return std::move(status).error();
    mark_round_points(chunk->view, reader_.parameters(), task.place.level, chunk->round);
    chunk->bounds = bounds_of(chunk->view.bricks, task.place.level);
    for (const BrickRecord &brick : chunk->view.bricks)
        chunk->largest_radius = std::max(chunk->largest_radius, brick.largest_radius);
    if (task.frame != nullptr)
        estimate_offsets(task, *chunk);
    return ResidentPointer(std::move(chunk));
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

std::uint64_t ChunkLoader::memory_of(int level, const ChunkEntry &entry) const {
    const ChunkShape &shape = entry.shape;
    const std::uint64_t field = fields_ ? std::uint64_t{1} + fields_->fields()[colours_->field].bytes : 0;
    const std::uint64_t round = has_round_points(reader_.parameters()) ? RoundPoints::kBytes : 0;
    const std::uint64_t offsets = ChunkOffsets::memory_of(shape) + (field + round) * shape.points;
    if (is_mapped()) // the bytes of a whole file take no memory
        return offsets + (reader_.source().is_whole() ? 0 : bytes_read_by(entry));
    const AttributeSet &set = reader_.parameters().attributes;
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
    std::optional<HeldBytes> field = fields_ ? reader_.source().view(ranges_of(place)[2]) : HeldBytes();
    if (!chunk || !field)
        return std::nullopt;
    return StoredChunk{std::move(*chunk), std::move(*field)};
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

void ChunkLoader::will_need(ChunkPlace place) const {
    for (const FileRange range : ranges_of(place))
        reader_.source().will_need(range);
}

void ChunkLoader::drop_bytes(ChunkPlace place) const {
    for (const FileRange range : ranges_of(place))
        reader_.source().drop(range);
}

std::uint64_t ChunkLoader::bytes_read_by(const ChunkEntry &entry) const {
    return entry.stored_bytes + (is_mapped() ? entry.shape.bricks * kBrickRecordBytes : 0);
}

} // namespace pbm
