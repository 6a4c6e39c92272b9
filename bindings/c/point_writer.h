// Decoded points of one level, or the sides of such points, in the caller's arrays.
#pragma once

#include "pbm.h"

#include "pbm_format/model/model.h"
#include "pbm_format/model/normal.h"
#include "pbm_format/model/octree.h"
#include "pbm_format/model/point_values.h"
#include "pbm_format/model/streams.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <span>
#include <vector>

namespace pbm::c_api {

inline constexpr std::size_t kRadii = 256;

// Points of one level as they were decoded, and the index of the first one in the caller's arrays.
struct DecodedPoints {
    const PointAttributes &attributes;
    std::size_t first;
    std::size_t count() const { return attributes.size(); }
};

// The children of a mask in ascending order, three bits each from the lowest ones on, and their number in the bits from
// kChildCount on: [masks].
inline constexpr unsigned kChildCount = 24;
inline constexpr std::array<std::uint32_t, 256> kChildren = [] {
    std::array<std::uint32_t, 256> children{};
    for (unsigned mask = 0; mask < children.size(); ++mask) {
        for (unsigned child = 8; child-- > 0;)
            if ((mask >> child & 1) != 0)
                children[mask] = children[mask] << 3 | child;
        children[mask] |= static_cast<unsigned>(std::popcount(mask)) << kChildCount;
    }
    return children;
}();

// Writes three numbers of four: a single store is faster, where the caller writes what follows later.
template <class Number> void store_four(Number *to, const std::array<Number, 4> &four) {
    std::memcpy(to, four.data(), sizeof four);
}

// Writes the first three numbers of value(0), value(1) .. value(count - 1) one after the other.
template <class Number, class Value> void write_threes(Number *to, std::size_t count, const Value &value) {
    for (std::size_t i = 0; i + 1 < count; ++i, to += 3)
        store_four(to, value(i));
    if (count > 0)
        std::copy_n(value(count - 1).data(), 3, to);
}

// An array of positions, and what is in it: along each axis the centres of the voxels of a level.
template <class Number> struct Positions {
    // `to`: may be null.
    Positions(Number *array, const Grid &grid, int level, const std::array<double, 3> &offset) : to(array) {
        const double edge = grid.voxel_size_at(level);
        for (std::size_t axis = 0; to != nullptr && axis < 3; ++axis)
            for (std::size_t voxel = 0; voxel < std::size_t{1} << level; ++voxel)
                centres[axis].push_back(
                    static_cast<Number>(grid.origin[axis] + (static_cast<double>(voxel) + 0.5) * edge - offset[axis]));
    }

    // Writes the children of voxels `parents`, one mask for each, as `count` points from `first` on.
    void place_children(std::span<const MortonCode> parents, ByteView masks, std::size_t first,
                        std::size_t count) const {
        if (to == nullptr)
            return;
        Number *next = to + 3 * first;
        const Number *const end = next + 3 * count;
        for (std::size_t n = 0; n < parents.size(); ++n) {
            const std::array<std::uint32_t, 3> parent = morton_decode(parents[n]);
            const std::array<const Number *, 3> at{&centres[0][2 * std::size_t{parent[0]}],
                                                   &centres[1][2 * std::size_t{parent[1]}],
                                                   &centres[2][2 * std::size_t{parent[2]}]};
            const std::uint32_t children = kChildren[masks[n]];
            const auto centre = [&](std::size_t i) -> std::array<Number, 4> {
                const std::uint32_t child = children >> 3 * i;
                return {at[0][child & 1], at[1][child >> 1 & 1], at[2][child >> 2 & 1], 0};
            };
            const std::size_t present = children >> kChildCount;
            constexpr std::size_t kGroup = 4; // so that most parents need no branch
            if (end - next > std::ptrdiff_t{3 * 2 * kGroup}) {
                for (std::size_t i = 0; i < kGroup; ++i)
                    store_four(next + 3 * i, centre(i));
                for (std::size_t i = kGroup; i < 2 * kGroup && present > kGroup; ++i)
                    store_four(next + 3 * i, centre(i));
                next += 3 * present;
            } else {
                for (std::size_t i = 0; i < present && next != end; ++i, next += 3)
                    std::copy_n(centre(i).data(), 3, next);
            }
        }
    }

    void place_root() const {
        for (std::size_t axis = 0; to != nullptr && axis < 3; ++axis)
            to[axis] = centres[axis][0];
    }

    Number *to;
    std::array<std::vector<Number>, 3> centres;
};

// Writes points of one level. Several threads write different ones.
class PointWriter {
  public:
    // `parameters` and `to` must outlive the writer.
    PointWriter(const ModelParameters &parameters, int level, const pbm_points &to)
        : to_(to), parameters_(parameters), positions_(to.positions, parameters.grid, level, {}),
          positions_f32_(to.positions_f32, parameters.grid, level, {to.offset[0], to.offset[1], to.offset[2]}) {
        if (to.normals != nullptr) {
            normals_.reserve(kNormalCount);
            for (const UnitVector &normal : normal_table())
                normals_.push_back(
                    {static_cast<float>(normal[0]), static_cast<float>(normal[1]), static_cast<float>(normal[2]), 0});
        }
        for (std::size_t i = 0; i < kRadii; ++i)
            radii_[i] = static_cast<float>(radius_fraction(static_cast<std::uint8_t>(i)) * parameters_.grid.edge());
        for (std::int32_t f = 0; f < to.field_count; ++f)
            fields_.push_back(values_of(f));
    }

    bool needs_positions() const { return to_.positions != nullptr || to_.positions_f32 != nullptr; }
    // What ChunkRules leave out.
    unsigned unwanted() const {
        const auto bit = [](StreamKind kind, bool is_wanted) {
            return is_wanted ? 0 : 1U << static_cast<unsigned>(kind);
        };
        const bool has_colours = parameters_.attributes.colour != ColourFormat::none;
        return bit(StreamKind::normal, to_.normals != nullptr || to_.two_sided != nullptr) |
               bit(StreamKind::radius, to_.radii != nullptr) | bit(StreamKind::colour, to_.colours != nullptr) |
               bit(StreamKind::material,
                   to_.materials != nullptr || to_.round != nullptr || (to_.colours != nullptr && !has_colours)) |
               bit(StreamKind::texture, false) | bit(StreamKind::shadow, false);
    }
    bool needs_field(std::size_t f) const { return f < fields_.size() && !fields_[f].empty(); }
    bool needs_fields() const {
        return std::any_of(fields_.begin(), fields_.end(), [](const auto &values) { return !values.empty(); });
    }

    // The root as point 0.
    void place_root() const {
        positions_.place_root();
        positions_f32_.place_root();
    }

    // The children of voxels `parents`, one mask for each, as `count` points from `first` on.
    void place_children(std::span<const MortonCode> parents, ByteView masks, std::size_t first,
                        std::size_t count) const {
        positions_.place_children(parents, masks, first, count);
        positions_f32_.place_children(parents, masks, first, count);
    }

    void write_attributes(const DecodedPoints &points) const {
        const PointAttributes &from = points.attributes;
        const std::size_t first = points.first, count = points.count();
        if (to_.normals != nullptr)
            write_threes(to_.normals + 3 * first, count,
                         [&](std::size_t i) { return normals_[from.normals[i] & kNormalIndexMask]; });
        if (to_.two_sided != nullptr)
            for (std::size_t i = 0; i < count; ++i)
                to_.two_sided[first + i] = (from.normals[i] & kTwoSidedBit) != 0 ? 1 : 0;
        if (to_.radii != nullptr)
            for (std::size_t i = 0; i < count; ++i)
                to_.radii[first + i] = radii_[from.radii[i]];
        if (to_.materials != nullptr)
            for (std::size_t i = 0; i < count; ++i)
                to_.materials[first + i] = material(from, i);
        if (to_.round != nullptr)
            for (std::size_t i = 0; i < count; ++i)
                to_.round[first + i] = is_round(parameters_.materials[material(from, i)]) ? 1 : 0;
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
        write_threes(to, points.count(), [&](std::size_t i) -> std::array<std::uint8_t, 4> {
            const Rgb8 colour = format == ColourFormat::none
                                    ? parameters_.materials[material(points.attributes, i)].colour
                                    : point_colour(colours, i, format);
            return {colour[0], colour[1], colour[2], 0};
        });
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
    const Positions<double> positions_;
    const Positions<float> positions_f32_;
    std::vector<std::array<float, 4>> normals_; // the last one is 0
    std::array<float, kRadii> radii_{};
    std::vector<std::vector<float>> fields_; // [fields of the caller][stored numbers]
};

} // namespace pbm::c_api
