// Exports the finest voxels of a model for other programs, so that peers are measured on the same points.
//
//   bench_voxels geometry MODEL.pbvg OUT.ply      integer positions
//   bench_voxels points MODEL.pbvg OUT.ply        integer positions, unit normals, 8-bit colours where there are any
//   bench_voxels dissertation MODEL.pbvg OUT.raw  the layout of the dissertation, see dissertation_layout
//
// Based on: Campbell. Point Based Modelling and Rendering. 2006, sections 5.1 and 5.2
#include "pbm_format/reading/load_model.h"
#include "system/files/mapped_file.h"

#include <bit>
#include <cstring>
#include <fstream>
#include <iostream>
#include <string_view>

namespace {

using namespace pbm;

void append(Bytes &out, const void *value, std::size_t bytes) {
    const auto *first = static_cast<const std::uint8_t *>(value);
    out.insert(out.end(), first, first + bytes);
}

std::vector<MortonCode> finest_codes(const Model &model) {
    std::vector<MortonCode> codes{0};
    for (std::size_t level = 1; level < model.levels.size(); ++level)
        codes = expand_level(codes, model.levels[level].masks, kMaxPoints).value();
    return codes;
}

// Binary little-endian PLY. draco_encoder stores integer positions without loss.
Bytes ply_of(const Model &model, bool geometry_only) {
    const PointAttributes &points = model.levels.back().points;
    const ColourFormat colour = model.parameters.attributes.colour;
    const bool coloured = !geometry_only && colour != ColourFormat::none;
    std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(points.size()) +
                         "\nproperty int x\nproperty int y\nproperty int z\n";
    if (!geometry_only)
        header += "property float nx\nproperty float ny\nproperty float nz\n";
    if (coloured)
        header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    header += "end_header\n";

    Bytes out(header.begin(), header.end());
    out.reserve(out.size() + points.size() * 27);
    const std::vector<MortonCode> codes = finest_codes(model);
    for (std::size_t i = 0; i < codes.size(); ++i) {
        const std::array<std::uint32_t, 3> place = morton_decode(codes[i]);
        append(out, place.data(), sizeof(place));
        if (!geometry_only)
            for (const double component : normal_table()[points.normals[i] & kNormalIndexMask]) {
                const auto rounded = static_cast<float>(component);
                append(out, &rounded, sizeof(rounded));
            }
        if (coloured) {
            const Rgb8 rgb = point_colour(points.colours, i, colour);
            append(out, rgb.data(), rgb.size());
        }
    }
    return out;
}

// Appends the child masks of the subtree below the next node of level `level - 1`, depth first. `next[L]`: index of the
// next mask of level L. All levels are in Morton order, so one cursor per level suffices.
void append_depth_first(const Model &model, std::size_t level, std::vector<std::size_t> &next, Bytes &out) {
    const std::uint8_t mask = model.levels[level].masks[next[level]++];
    out.push_back(mask);
    if (level + 1 < model.levels.size())
        for (int child = 0; child < std::popcount(mask); ++child)
            append_depth_first(model, level + 1, next, out);
}

// 48 bits: normal 13, colour 565 16, material 3, radius 8, shadow flags 8; without the dissertation's 16 bits of
// padding. A shadow flag is set if the lit fraction exceeds 1/2.
std::uint64_t record_of(const Model &model, std::size_t i) {
    const PointAttributes &points = model.levels.back().points;
    const AttributeSet &set = model.parameters.attributes;
    std::uint64_t record = points.normals[i] & kNormalIndexMask;
    if (set.colour != ColourFormat::none)
        record |= std::uint64_t{pack_565(point_colour(points.colours, i, set.colour))} << 13;
    if (set.material)
        record |= std::uint64_t{points.materials[i]} << 29;
    record |= std::uint64_t{points.radii[i]} << 32;
    for (std::size_t light = 0; light < static_cast<std::size_t>(set.lights); ++light) {
        const unsigned full =
            (1U << set.shadow_bits[light].at(static_cast<std::size_t>(model.parameters.grid.depth))) - 1;
        record |= std::uint64_t{2U * points.shadows[light][i] > full} << (40 + light);
    }
    return record;
}

// The mask of the eight octant grids, then for each of them its masks depth first and a record per leaf.
Bytes dissertation_layout(const Model &model) {
    constexpr std::size_t kRecordBytes = 6;
    Bytes out{model.levels[1].masks[0]};
    std::vector<std::size_t> next(model.levels.size(), 0);
    std::size_t point = 0;
    for (int octant = 0; octant < std::popcount(model.levels[1].masks[0]); ++octant) {
        std::size_t end = point;
        const std::size_t first_leaf_mask = next.back();
        append_depth_first(model, 2, next, out);
        for (std::size_t mask = first_leaf_mask; mask < next.back(); ++mask)
            end += static_cast<std::size_t>(std::popcount(model.levels.back().masks[mask]));
        for (; point < end; ++point) {
            const std::uint64_t record = record_of(model, point);
            append(out, &record, kRecordBytes);
        }
    }
    return out;
}

int fail(std::string_view path, std::string_view message) {
    std::cerr << "bench_voxels: " << path << ": " << message << '\n';
    return 2;
}

} // namespace

int main(int argc, char **argv) {
    static_assert(std::endian::native == std::endian::little);
    const std::string_view what = argc == 4 ? argv[1] : "";
    if (what != "geometry" && what != "points" && what != "dissertation") {
        std::cerr << "usage: bench_voxels geometry|points|dissertation MODEL.pbvg OUT\n";
        return 1;
    }
    const Result<MappedFile> file = MappedFile::open(argv[2]);
    if (!file)
        return fail(argv[2], file.error().message);
    Result<Reader> reader = Reader::open(file->bytes());
    if (!reader)
        return fail(argv[2], reader.error().message);
    const Result<Model> model = load_model(*reader);
    if (!model)
        return fail(argv[2], model.error().message);
    const Bytes bytes = what == "dissertation" ? dissertation_layout(*model) : ply_of(*model, what == "geometry");
    std::ofstream out(argv[3], std::ios::binary);
    out.write(reinterpret_cast<const char *>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return out.flush() ? 0 : fail(argv[3], "cannot write");
}
