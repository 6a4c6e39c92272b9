// Rules that tie the parts of a file together: hashes of sections, counts that two parts state, the split into chunks.
// Reader and validator verify 2.18, 3.2.14, 5.5.11 and 5.10.2. The validator alone verifies 5.2; a renderer reports it
// for a packed chunk whose bricks it cannot index. BVG.md 2.18, 3.2.14, 5.2, 5.5.11, 5.10.2
#pragma once

#include "pbm_format/container/field_sections.h"

namespace pbm {

// `stored`: the bytes of the section.
Status verify_hash(ByteView stored, const SectionEntry &section);
Status check_point_count(const FileHeader &header, const SectionEntry &finest_chunks);
// `entry` must be an element of `sections`: the error lies in the section table.
Status check_chunk_count(const LevelDirectory &directory, const SectionEntry &entry,
                         std::span<const SectionEntry> sections);
Status check_brick_count(const LevelDirectory &directory, const SectionEntry &bricks);

// 5.2: the error of a chunk that differs from the one that the octree gives; null if there is no such chunk.
Error wrong_split(std::uint64_t offset, const ChunkShape *expected, const ChunkShape *actual);

// Reads the small sections that describe a model, all but metadata, in the order of the file. Calls `read(entry, to,
// decode)` for each, which decodes the entry's bytes into the parameter `to` and returns whether that succeeded.
// Returns whether all succeeded.
template <class Read>
bool read_small_sections(const FileHeader &header, std::span<const SectionEntry> sections, ModelParameters &parameters,
                         Read &&read) {
    const auto section = [&](SectionType type) { return find_section(sections, type); };
    const int depth = header.depth;
    parameters.closed = header.closed();
    bool all = read(*section(SectionType::grid), parameters.grid,
                    [depth](ByteView bytes) { return decode_grid(bytes, depth); });
    all &= read(*section(SectionType::attributes), parameters.attributes,
                [depth](ByteView bytes) { return decode_attributes(bytes, depth); });
    all &= read(*section(SectionType::materials), parameters.materials, decode_materials);
    if (const SectionEntry *lights = section(SectionType::lights))
        all &= read(*lights, parameters.lights, decode_lights);
    if (const SectionEntry *texture = section(SectionType::texture))
        all &= read(*texture, parameters.texture.emplace_back(), decode_texture);
    if (const SectionEntry *ground = section(SectionType::ground_plane))
        all &= read(*ground, parameters.ground, decode_ground_plane);
    if (const SectionEntry *shapes = section(SectionType::shapes); all && shapes != nullptr)
        all = read(*shapes, parameters.materials,
                   [&](ByteView bytes) { return decode_shapes(bytes, parameters.materials); });
    if (const SectionEntry *fields = section(SectionType::fields)) {
        FieldTable table;
        all &= read(*fields, table, decode_fields);
        parameters.fields = std::move(table.fields);
    }
    return all;
}

} // namespace pbm
