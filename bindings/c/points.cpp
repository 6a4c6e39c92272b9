// Points of a level in the caller's arrays.
#include "model.h"
#include "point_writer.h"

#include "pbm_format/chunks/chunk.h"
#include "pbm_format/model/octree.h"
#include "pbm_format/reading/field_reader.h"
#include "pbm_format/reading/load_model.h"
#include "system/threads/parallel.h"
#include "system/threads/per_thread.h"

#include <algorithm>
#include <bit>
#include <optional>
#include <span>

namespace pbm::c_api {
namespace {

// Writes the codes of the children of voxels `parents`, one mask for each, to codes[0], codes[1] ..
void expand(std::span<const MortonCode> parents, ByteView masks, std::span<MortonCode> codes) {
    std::size_t i = 0;
    for (std::size_t n = 0; n < parents.size(); ++n)
        for (unsigned mask = masks[n]; mask != 0 && i < codes.size(); mask &= mask - 1)
            codes[i++] = parents[n] << 3 | static_cast<MortonCode>(std::countr_zero(mask));
}

// Codes of the voxels of a level from those of the level above.
std::vector<MortonCode> expand(const std::vector<MortonCode> &above, ByteView masks, const LevelDirectory &directory,
                               int threads) {
    std::vector<MortonCode> codes(static_cast<std::size_t>(directory.points));
    parallel_for(directory.chunks.size(), threads, [&](std::size_t c) {
        const ChunkEntry &chunk = directory.chunks[c];
        const auto node = static_cast<std::size_t>(chunk.first_node),
                   point = static_cast<std::size_t>(chunk.first_point);
        expand(std::span(above).subspan(node, chunk.shape.nodes), slice(masks, node, chunk.shape.nodes),
               std::span(codes).subspan(point, chunk.shape.points));
    });
    return codes;
}

// Decodes the chunks of a level one by one and writes their points: they are nowhere as a whole but in the caller's
// arrays.
class LevelReader {
  public:
    // `above` holds the levels above, with fields if the writer needs any. All must outlive the reader.
    LevelReader(const Reader &reader, const Model &above, const LevelDirectory &directory, const PointWriter &writer)
        : reader_(reader), above_(above.levels.back()), directory_(directory), writer_(writer) {}

    Status open_fields() {
        Result<FieldReader> opened = FieldReader::open(reader_);
        if (!opened)
            return opened.error();
        fields_ = std::move(*opened);
        return fields_->read_directory(directory_);
    }

    // `parents`: codes of the level above the level above, if positions are needed; none for level 1.
    Status run(const std::vector<MortonCode> &parents, int threads) const {
        return for_chunks(reader_, directory_, above_, threads, writer_.unwanted(),
                          [&](std::size_t index, const Chunk &chunk) { return write_chunk(index, chunk, parents); });
    }

  private:
    // The codes of a chunk's nodes. Those of the whole level would be a fourth of all points.
    std::span<const MortonCode> nodes_of(const ChunkEntry &entry, const std::vector<MortonCode> &parents) const {
        std::vector<MortonCode> &nodes = per_thread<std::vector<MortonCode>>();
        nodes.assign(entry.shape.nodes, 0); // the root
        const auto first = static_cast<std::size_t>(entry.first_parent);
        if (directory_.level > 1)
            expand(std::span(parents).subspan(first, entry.shape.parents),
                   slice(above_.masks, first, entry.shape.parents), nodes);
        return nodes;
    }

    Status write_chunk(std::size_t index, const Chunk &chunk, const std::vector<MortonCode> &parents) const {
        const ChunkEntry &entry = directory_.chunks[index];
        const auto first = static_cast<std::size_t>(entry.first_point);
        if (writer_.needs_positions())
            writer_.place_children(nodes_of(entry, parents), chunk.masks, first, entry.shape.points);
        writer_.write_attributes({chunk.points, first});
        Bytes stored;
        for (std::size_t f = 0; fields_ && f < fields_->fields().size(); ++f) {
            if (!writer_.needs_field(f))
                continue;
            const std::uint64_t bytes = fields_->fields()[f].bytes;
            const ByteView node_values = slice(above_.fields[f], bytes * entry.first_node, bytes * entry.shape.nodes);
            if (Status loaded = fields_->load(directory_.level, index, f, chunk.masks, node_values, stored); !loaded)
                return loaded;
            writer_.write_field(f, stored, first);
        }
        return {};
    }

    const Reader &reader_;
    const Level &above_;
    const LevelDirectory &directory_;
    const PointWriter &writer_;
    std::optional<FieldReader> fields_;
};

// Writes the root.
Status write_root(const Reader &reader, const PointWriter &writer) {
    const PointAttributes root = root_points(reader.header().root, reader.parameters().attributes);
    writer.place_root();
    writer.write_attributes({root, 0});
    if (!writer.needs_fields())
        return {};
    const Result<FieldReader> fields = FieldReader::open(reader);
    if (!fields)
        return fields.error();
    for (std::size_t f = 0; f < fields->fields().size(); ++f)
        if (writer.needs_field(f))
            writer.write_field(f, fields->root_value(f), 0);
    return {};
}

// Writes all points of a level.
Status write_points(Reader &reader, int level, const pbm_points &to) {
    const PointWriter writer(reader.parameters(), level, to);
    if (level == 0)
        return write_root(reader, writer);
    const Result<const LevelDirectory *> directory = reader.directory(level);
    if (!directory)
        return directory.error();
    const Result<Model> above =
        load_points(reader, {.max_level = level - 1, .threads = to.threads, .fields = writer.needs_fields()});
    if (!above)
        return above.error();
    std::vector<MortonCode> parents{0};
    for (int l = 1; writer.needs_positions() && l < level - 1; ++l)
        parents =
            expand(parents, above->levels[static_cast<std::size_t>(l)].masks, *reader.directory(l).value(), to.threads);
    LevelReader chunks(reader, *above, **directory, writer);
    if (writer.needs_fields())
        if (Status opened = chunks.open_fields(); !opened)
            return opened;
    return chunks.run(parents, to.threads);
}

Result<std::uint64_t> count_points(OpenModel &model, std::int32_t level) {
    if (Status checked = check_level(model, level); !checked)
        return std::move(checked).error();
    if (level == 0)
        return std::uint64_t{1};
    const Result<const LevelDirectory *> directory = model.directory(level);
    if (!directory)
        return directory.error();
    return (*directory)->points;
}

// Errors of the caller's arrays for `count` points.
Status check_arrays(const pbm_points &to, const ModelParameters &parameters, std::uint64_t count) {
    if (to.capacity < count)
        return no_room(to.capacity, count);
    if (to.field_count < 0 || static_cast<std::size_t>(to.field_count) > parameters.fields.size())
        return usage_error("points.field_count is " + std::to_string(to.field_count) + ", the model has " +
                           std::to_string(parameters.fields.size()));
    if (to.field_count > 0 && to.fields == nullptr)
        return usage_error("points.fields is null");
    return check_threads(to.threads);
}

Status read_points(OpenModel &model, std::int32_t level, const pbm_points *points, std::uint64_t *written) {
    const Result<pbm_points> to = read_structure(points, "points", offsetof(pbm_points, round));
    if (!to)
        return to.error();
    const Result<std::uint64_t> count = count_points(model, level);
    if (!count)
        return count.error();
    if (Status checked = check_arrays(*to, model.reader.parameters(), *count); !checked)
        return checked;
    const bool needs_fields =
        std::any_of(to->fields, to->fields + to->field_count, [](const float *values) { return values != nullptr; });
    std::optional<Reader> whole; // fields are read from the whole file
    if (needs_fields && !model.bytes.is_whole()) {
        const Result<ByteView> bytes = model.bytes.whole();
        if (!bytes)
            return bytes.error();
        Result<Reader> opened = Reader::open(*bytes);
        if (!opened)
            return opened.error();
        whole = std::move(*opened);
    } else if (Status fetched = fetch_levels(model, level); !fetched) {
        return fetched;
    }
    Status done = write_points(whole ? *whole : model.reader, level, *to);
    drop_levels(model, level);
    if (!done)
        return done;
    if (written != nullptr)
        *written = *count;
    return {};
}

} // namespace
} // namespace pbm::c_api

using namespace pbm;
using namespace pbm::c_api;

pbm_code pbm_count_points(pbm_model *model, int32_t level, uint64_t *points, pbm_error *error) {
    return count_level(model, level, points, error, count_points);
}

pbm_code pbm_read_points(pbm_model *model, int32_t level, const pbm_points *points, uint64_t *written,
                         pbm_error *error) {
    return guarded(error, [&] {
        return models().use(model, "model", [&](OpenModel &open) { return read_points(open, level, points, written); });
    });
}
