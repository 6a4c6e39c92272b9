// Points of a level in the caller's arrays.
#include "model.h"

#include "pbm_format/chunks/chunk.h"
#include "pbm_format/model/octree.h"
#include "pbm_format/reading/field_reader.h"
#include "pbm_format/reading/load_model.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <optional>
#include <span>

namespace pbm::c_api {
namespace {

constexpr std::size_t kRadii = 256;

// Points of one level as they were decoded, and the index of the first one in the caller's arrays.
struct DecodedPoints {
    const PointAttributes &attributes;
    std::size_t first;
    std::size_t count() const { return attributes.size(); }
};

// Writes points of one level. Several threads write different ones.
class PointWriter {
  public:
    // `parameters` and `to` must outlive the writer.
    PointWriter(const ModelParameters &parameters, int level, const pbm_points &to)
        : to_(to), parameters_(parameters), edge_(parameters.grid.voxel_size_at(level)) {
        if (to.normals != nullptr) {
            normals_.reserve(kNormalCount);
            for (const UnitVector &normal : normal_table())
                normals_.push_back(
                    {static_cast<float>(normal[0]), static_cast<float>(normal[1]), static_cast<float>(normal[2])});
        }
        for (std::size_t i = 0; i < kRadii; ++i)
            radii_[i] = static_cast<float>(radius_fraction(static_cast<std::uint8_t>(i)) * parameters_.grid.edge());
        for (std::int32_t f = 0; f < to.field_count; ++f)
            fields_.push_back(values_of(f));
    }

    bool needs_positions() const { return to_.positions != nullptr || to_.positions_f32 != nullptr; }
    bool needs_field(std::size_t f) const { return f < fields_.size() && !fields_[f].empty(); }
    bool needs_fields() const {
        return std::any_of(fields_.begin(), fields_.end(), [](const auto &values) { return !values.empty(); });
    }

    // The root as point 0.
    void place_root() const {
        place(to_.positions, [this](std::size_t axis) { return centre(axis, 0); });
        place(to_.positions_f32, [this](std::size_t axis) { return centre(axis, 0) - to_.offset[axis]; });
    }

    // The children of voxels `parents`, one mask for each, as `count` points from `first` on.
    void place_children(std::span<const MortonCode> parents, ByteView masks, std::size_t first,
                        std::size_t count) const {
        if (to_.positions != nullptr)
            place_children(to_.positions + 3 * first, {}, parents, masks, count);
        if (to_.positions_f32 != nullptr)
            place_children(to_.positions_f32 + 3 * first, {to_.offset[0], to_.offset[1], to_.offset[2]}, parents, masks,
                           count);
    }

    void write_attributes(const DecodedPoints &points) const {
        const PointAttributes &from = points.attributes;
        const std::size_t first = points.first, count = points.count();
        if (to_.normals != nullptr)
            for (std::size_t i = 0; i < count; ++i)
                std::copy_n(normals_[from.normals[i] & kNormalIndexMask].data(), 3, to_.normals + 3 * (first + i));
        if (to_.two_sided != nullptr)
            for (std::size_t i = 0; i < count; ++i)
                to_.two_sided[first + i] = (from.normals[i] & kTwoSidedBit) != 0 ? 1 : 0;
        if (to_.radii != nullptr)
            for (std::size_t i = 0; i < count; ++i)
                to_.radii[first + i] = radii_[from.radii[i]];
        if (to_.materials != nullptr)
            for (std::size_t i = 0; i < count; ++i)
                to_.materials[first + i] = material(from, i);
        if (to_.colours != nullptr)
            write_colours(points);
    }

    // `stored`: the numbers of a field that needs_field.
    void write_field(std::size_t f, ByteView stored, std::size_t first) const {
        const std::uint8_t bytes = parameters_.fields[f].bytes;
        for (std::size_t i = 0; i < stored.size() / bytes; ++i)
            to_.fields[f][first + i] = fields_[f][stored_value(stored, i, bytes)];
    }

  private:
    double centre(std::size_t axis, std::uint32_t voxel) const {
        return parameters_.grid.origin[axis] + (voxel + 0.5) * edge_;
    }

    template <class Number, class Coordinate> static void place(Number *to, const Coordinate &coordinate) {
        for (std::size_t axis = 0; to != nullptr && axis < 3; ++axis)
            to[axis] = static_cast<Number>(coordinate(axis));
    }

    template <class Number>
    void place_children(Number *to, const std::array<double, 3> &offset, std::span<const MortonCode> parents,
                        ByteView masks, std::size_t count) const {
        const Number *const end = to + 3 * count;
        for (std::size_t n = 0; n < parents.size(); ++n) {
            const std::array<std::uint32_t, 3> parent = morton_decode(parents[n]);
            std::array<std::array<Number, 2>, 3> at; // of the two halves along each axis
            for (std::size_t axis = 0; axis < 3; ++axis)
                for (std::uint32_t half = 0; half < 2; ++half)
                    at[axis][half] = static_cast<Number>(centre(axis, 2 * parent[axis] + half) - offset[axis]);
            for (unsigned mask = masks[n]; mask != 0 && to != end; mask &= mask - 1, to += 3) {
                const auto child = static_cast<unsigned>(std::countr_zero(mask));
                to[0] = at[0][child & 1];
                to[1] = at[1][child >> 1 & 1];
                to[2] = at[2][child >> 2];
            }
        }
    }

    std::uint8_t material(const PointAttributes &from, std::size_t i) const {
        return parameters_.attributes.material ? from.materials[i] : std::uint8_t{0};
    }

    void write_colours(const DecodedPoints &points) const {
        const ColourFormat format = parameters_.attributes.colour;
        const Bytes &colours = points.attributes.colours;
        std::uint8_t *to = to_.colours + 3 * points.first;
        if (format == ColourFormat::rgb888) {
            std::copy_n(colours.data(), 3 * points.count(), to);
            return;
        }
        for (std::size_t i = 0; i < points.count(); ++i, to += 3) {
            const Rgb8 colour = format == ColourFormat::none
                                    ? parameters_.materials[material(points.attributes, i)].colour
                                    : point_colour(colours, i, format);
            std::copy(colour.begin(), colour.end(), to);
        }
    }

    // The values of all stored numbers of a field; none if the caller does not want it.
    std::vector<float> values_of(std::int32_t number) const {
        if (to_.fields[number] == nullptr)
            return {};
        const Field &field = parameters_.fields[static_cast<std::size_t>(number)];
        std::vector<float> values{std::numeric_limits<float>::quiet_NaN()};
        for (std::uint32_t stored = 1; stored <= field.max_stored(); ++stored)
            values.push_back(static_cast<float>(field.value(stored)));
        return values;
    }

    const pbm_points &to_;
    const ModelParameters &parameters_;
    const double edge_; // of a voxel
    std::vector<std::array<float, 3>> normals_;
    std::array<float, kRadii> radii_{};
    std::vector<std::vector<float>> fields_; // [fields of the caller][stored numbers]
};

std::span<const MortonCode> nodes_of(const std::vector<MortonCode> &codes, const ChunkEntry &chunk) {
    return std::span(codes).subspan(static_cast<std::size_t>(chunk.first_node), chunk.shape.nodes);
}

// Codes of the voxels of a level from those of the level above.
std::vector<MortonCode> expand(const std::vector<MortonCode> &above, ByteView masks, const LevelDirectory &directory,
                               int threads) {
    std::vector<MortonCode> codes(static_cast<std::size_t>(directory.points));
    parallel_for(directory.chunks.size(), threads, [&](std::size_t c) {
        const ChunkEntry &chunk = directory.chunks[c];
        auto i = static_cast<std::size_t>(chunk.first_point);
        const std::size_t end = i + chunk.shape.points;
        const std::span<const MortonCode> nodes = nodes_of(above, chunk);
        const ByteView chunk_masks = slice(masks, chunk.first_node, chunk.shape.nodes);
        for (std::size_t n = 0; n < nodes.size(); ++n)
            for (unsigned mask = chunk_masks[n]; mask != 0 && i < end; mask &= mask - 1)
                codes[i++] = nodes[n] << 3 | static_cast<MortonCode>(std::countr_zero(mask));
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

    // `nodes`: codes of the level above, if positions are needed.
    Status run(const std::vector<MortonCode> &nodes, int threads) const {
        return for_chunks(reader_, directory_, above_, threads,
                          [&](std::size_t index, const Chunk &chunk) { return write_chunk(index, chunk, nodes); });
    }

  private:
    Status write_chunk(std::size_t index, const Chunk &chunk, const std::vector<MortonCode> &nodes) const {
        const ChunkEntry &entry = directory_.chunks[index];
        const auto first = static_cast<std::size_t>(entry.first_point);
        if (writer_.needs_positions())
            writer_.place_children(nodes_of(nodes, entry), chunk.masks, first, entry.shape.points);
        writer_.write_attributes({chunk.points, first});
        Bytes stored;
        for (std::size_t f = 0; fields_ && f < fields_->fields().size(); ++f) {
            if (!writer_.needs_field(f))
                continue;
            const std::uint64_t bytes = fields_->fields()[f].bytes;
            const ByteView parents = slice(above_.fields[f], bytes * entry.first_node, bytes * entry.shape.nodes);
            if (Status loaded = fields_->load(directory_.level, index, f, chunk.masks, parents, stored); !loaded)
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
    std::vector<MortonCode> nodes{0};
    for (int l = 1; writer.needs_positions() && l < level; ++l)
        nodes =
            expand(nodes, above->levels[static_cast<std::size_t>(l)].masks, *reader.directory(l).value(), to.threads);
    LevelReader chunks(reader, *above, **directory, writer);
    if (writer.needs_fields())
        if (Status opened = chunks.open_fields(); !opened)
            return opened;
    return chunks.run(nodes, to.threads);
}

Result<std::uint64_t> count_points(OpenModel &model, std::int32_t level) {
    if (level < 0 || level > model.reader.depth())
        return usage("level " + std::to_string(level) + " is not there: the model has levels 0 .. " +
                     std::to_string(model.reader.depth()));
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
        return usage("the arrays have room for " + std::to_string(to.capacity) + " points, the level has " +
                     std::to_string(count));
    if (to.field_count < 0 || static_cast<std::size_t>(to.field_count) > parameters.fields.size())
        return usage("points.field_count is " + std::to_string(to.field_count) + ", the model has " +
                     std::to_string(parameters.fields.size()));
    if (to.field_count > 0 && to.fields == nullptr)
        return usage("points.fields is null");
    return check_threads(to.threads);
}

Status read_points(OpenModel &model, std::int32_t level, const pbm_points *points, std::uint64_t *written) {
    const Result<pbm_points> to = read_structure(points, "points");
    if (!to)
        return to.error();
    const Result<std::uint64_t> count = count_points(model, level);
    if (!count)
        return count.error();
    if (Status checked = check_arrays(*to, model.reader.parameters(), *count); !checked)
        return checked;
    const bool needs_fields =
        std::any_of(to->fields, to->fields + to->field_count, [](const float *values) { return values != nullptr; });
    std::optional<Reader> whole; // fields are read from whole files alone
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
    return guarded(error, [&] {
        return models().use(model, "model", [&](OpenModel &open) -> Status {
            if (points == nullptr)
                return usage("points is null");
            const Result<std::uint64_t> count = count_points(open, level);
            if (!count)
                return count.error();
            *points = *count;
            return {};
        });
    });
}

pbm_code pbm_read_points(pbm_model *model, int32_t level, const pbm_points *points, uint64_t *written,
                         pbm_error *error) {
    return guarded(error, [&] {
        return models().use(model, "model", [&](OpenModel &open) { return read_points(open, level, points, written); });
    });
}
