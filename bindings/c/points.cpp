// Points of a level in the caller's arrays.
#include "model.h"

#include "pbm_format/model/octree.h"
#include "pbm_format/reading/load_model.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <array>
#include <limits>
#include <span>

namespace pbm::c_api {
namespace {

constexpr std::size_t kRadii = 256;

// A range of points of one level: those of a chunk, or the root.
struct PointRange {
    std::size_t first, count;
};

// Writes points of one level. Several threads write different ranges.
class PointWriter {
  public:
    PointWriter(const Model &model, int level, const pbm_points &to)
        : to_(to), parameters_(model.parameters), level_(model.levels[static_cast<std::size_t>(level)]),
          edge_(parameters_.grid.voxel_size_at(level)) {
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

    // The centre of voxel (x, y, z) as point `i`.
    void place(std::size_t i, const std::array<std::uint32_t, 3> &voxel) const {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double at = parameters_.grid.origin[axis] + (voxel[axis] + 0.5) * edge_;
            if (to_.positions != nullptr)
                to_.positions[3 * i + axis] = at;
            if (to_.positions_f32 != nullptr)
                to_.positions_f32[3 * i + axis] = static_cast<float>(at - to_.offset[axis]);
        }
    }

    // The children of voxels `parents`, one mask for each, as the points of `range`.
    void place_children(std::span<const MortonCode> parents, ByteView masks, PointRange range) const {
        std::size_t i = range.first;
        const std::size_t end = range.first + range.count;
        for (std::size_t n = 0; n < parents.size(); ++n) {
            const std::array<std::uint32_t, 3> parent = morton_decode(parents[n]);
            for (unsigned mask = masks[n]; mask != 0 && i < end; mask &= mask - 1, ++i) {
                const auto child = static_cast<unsigned>(std::countr_zero(mask));
                place(i, {2 * parent[0] + (child & 1), 2 * parent[1] + (child >> 1 & 1), 2 * parent[2] + (child >> 2)});
            }
        }
    }

    void write_attributes(PointRange range) const {
        const PointAttributes &points = level_.points;
        const std::size_t first = range.first, last = range.first + range.count;
        if (to_.normals != nullptr)
            for (std::size_t i = first; i < last; ++i)
                std::copy_n(normals_[points.normals[i] & kNormalIndexMask].data(), 3, to_.normals + 3 * i);
        if (to_.two_sided != nullptr)
            for (std::size_t i = first; i < last; ++i)
                to_.two_sided[i] = (points.normals[i] & kTwoSidedBit) != 0 ? 1 : 0;
        if (to_.radii != nullptr)
            for (std::size_t i = first; i < last; ++i)
                to_.radii[i] = radii_[points.radii[i]];
        if (to_.materials != nullptr)
            for (std::size_t i = first; i < last; ++i)
                to_.materials[i] = material(i);
        if (to_.colours != nullptr)
            write_colours(first, last);
        for (std::size_t f = 0; f < fields_.size(); ++f)
            if (to_.fields[f] != nullptr)
                for (std::size_t i = first; i < last; ++i)
                    to_.fields[f][i] = fields_[f][stored_value(level_.fields[f], i, parameters_.fields[f].bytes)];
    }

  private:
    std::uint8_t material(std::size_t i) const {
        return parameters_.attributes.material ? level_.points.materials[i] : std::uint8_t{0};
    }

    void write_colours(std::size_t first, std::size_t last) const {
        const ColourFormat format = parameters_.attributes.colour;
        const Bytes &colours = level_.points.colours;
        if (format == ColourFormat::rgb888) {
            std::copy_n(colours.data() + 3 * first, 3 * (last - first), to_.colours + 3 * first);
            return;
        }
        for (std::size_t i = first; i < last; ++i) {
            const Rgb8 colour = format == ColourFormat::none ? parameters_.materials[material(i)].colour
                                                             : point_colour(colours, i, format);
            std::copy(colour.begin(), colour.end(), to_.colours + 3 * i);
        }
    }

    // The values of all stored numbers of a field.
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
    const Level &level_;
    const double edge_; // of a voxel
    std::vector<std::array<float, 3>> normals_;
    std::array<float, kRadii> radii_{};
    std::vector<std::vector<float>> fields_;
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

// Writes all points of a level. `reader` has read the directories.
Status write_points(Reader &reader, const Model &model, int level, const pbm_points &to) {
    const PointWriter writer(model, level, to);
    if (level == 0) {
        if (writer.needs_positions())
            writer.place(0, {0, 0, 0});
        writer.write_attributes({0, 1});
        return {};
    }
    std::vector<MortonCode> codes{0};
    for (int l = 1; writer.needs_positions() && l < level; ++l)
        codes =
            expand(codes, model.levels[static_cast<std::size_t>(l)].masks, *reader.directory(l).value(), to.threads);
    const LevelDirectory &directory = *reader.directory(level).value();
    const Bytes &masks = model.levels[static_cast<std::size_t>(level)].masks;
    parallel_for(directory.chunks.size(), to.threads, [&](std::size_t c) {
        const ChunkEntry &chunk = directory.chunks[c];
        const PointRange range{static_cast<std::size_t>(chunk.first_point), chunk.shape.points};
        if (writer.needs_positions())
            writer.place_children(nodes_of(codes, chunk), slice(masks, chunk.first_node, chunk.shape.nodes), range);
        writer.write_attributes(range);
    });
    return {};
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
    Reader &reader = whole ? *whole : model.reader;
    const Result<Model> loaded =
        load_points(reader, {.max_level = level, .threads = to->threads, .fields = needs_fields});
    drop_levels(model, level);
    if (!loaded)
        return loaded.error();
    if (Status done = write_points(reader, *loaded, level, *to); !done)
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
