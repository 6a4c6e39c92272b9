#include "pbm_format/container/section_encoder.h"

#include "pbm_format/hashes/hash.h"

#include <cassert>

namespace pbm {

Bytes encode_header(const FileHeader &header) {
    ByteWriter out;
    out.append(kMagic);
    out.u16(header.major);
    out.u16(header.minor);
    out.u32(header.endian);
    out.u64(header.file_size);
    out.u64(header.table_offset);
    out.u32(header.table_count);
    out.u8(header.depth);
    out.zeros(3);
    out.u64(header.required_features);
    out.u64(header.optional_features);
    out.u64(header.point_count);
    out.u64(header.raw_bytes);
    out.u64(header.content_id[0]);
    out.u64(header.content_id[1]);
    out.append(header.root.bytes);
    out.u32(header.chunk_points);
    out.zeros(4);
    out.u64(header.table_hash);
    out.u64(hash64(out.bytes()));
    assert(out.size() == kHeaderBytes);
    return out.take();
}

Bytes encode_section_table(std::span<const SectionEntry> entries) {
    ByteWriter out;
    for (const SectionEntry &entry : entries) {
        out.u32(static_cast<std::uint32_t>(entry.type));
        out.u16(static_cast<std::uint16_t>(entry.codec));
        out.u16(entry.flags);
        out.u32(entry.instance);
        out.u32(entry.element_bytes);
        out.u32(entry.alignment);
        out.zeros(4);
        out.u64(entry.offset);
        out.u64(entry.stored_bytes);
        out.u64(entry.raw_bytes);
        out.u64(entry.count);
        out.u64(entry.hash);
    }
    return out.take();
}

Bytes encode_grid(const Grid &grid) {
    ByteWriter out;
    for (const double coordinate : grid.origin)
        out.f64(coordinate);
    out.f64(grid.voxel_size);
    out.u8(static_cast<std::uint8_t>(grid.unit));
    out.u8(static_cast<std::uint8_t>(grid.up));
    out.zeros(14);
    return out.take();
}

Bytes encode_attributes(const AttributeSet &set, int depth) {
    ByteWriter out;
    for (const StreamInfo &stream : streams_of(set)) {
        if (stream.kind == StreamKind::masks)
            continue;
        out.u8(static_cast<std::uint8_t>(stream.kind));
        out.u8(stream.kind == StreamKind::colour ? static_cast<std::uint8_t>(set.colour) : std::uint8_t{0});
        out.u8(stream.light);
        out.u8(0);
        for (std::size_t level = 0; level <= kMaxDepth; ++level)
            out.u8(stream.kind == StreamKind::shadow && static_cast<int>(level) <= depth
                       ? set.shadow_bits[stream.light][level]
                       : std::uint8_t{0});
        out.zeros(3);
    }
    return out.take();
}

Bytes encode_shapes(std::span<const Material> materials) {
    ByteWriter out;
    for (const Material &material : materials) {
        out.u8(static_cast<std::uint8_t>(material.shape));
        out.u8(material.tint);
        out.zeros(kShapeBytes - 2);
    }
    return out.take();
}

Bytes encode_materials(std::span<const Material> materials) {
    ByteWriter out;
    for (const Material &material : materials) {
        out.f32(material.ka);
        out.f32(material.kd);
        out.f32(material.ks);
        out.f32(material.power);
        out.append(material.colour);
        out.zeros(1);
        out.f32(material.environment);
        out.zeros(8);
    }
    return out.take();
}

Bytes encode_lights(std::span<const Light> lights) {
    ByteWriter out;
    for (const Light &light : lights) {
        out.u8(static_cast<std::uint8_t>(light.kind));
        out.zeros(3);
        for (const auto &vector : {light.intensity, light.position, light.direction})
            for (const float component : vector)
                out.f32(component);
        out.f32(light.exponent);
        out.zeros(4);
    }
    return out.take();
}

Bytes encode_texture(const SolidTexture &texture) {
    ByteWriter out;
    out.u8(static_cast<std::uint8_t>(texture.kind));
    out.zeros(3);
    out.u32(texture.seed);
    out.f32(texture.scale);
    out.f32(texture.turbulence);
    out.zeros(16);
    for (const Rgb8 &colour : texture.palette)
        out.append(colour);
    return out.take();
}

Bytes encode_ground_plane(const GroundPlane &ground) {
    ByteWriter out;
    for (const float coordinate : ground.centre)
        out.f32(coordinate);
    out.f32(ground.half_edge);
    out.u8(ground.material);
    out.zeros(15);
    if (ground.texture)
        out.append(encode_texture(*ground.texture));
    return out.take();
}

Bytes encode_directory(const LevelDirectory &directory, const AttributeSet &set) {
    ByteWriter out;
    for (const ChunkEntry &chunk : directory.chunks) {
        assert(chunk.streams.size() == streams_of(set).size());
        out.u64(chunk.shape.root_prefix);
        out.u64(chunk.hash);
        out.u32(chunk.shape.points);
        out.u32(chunk.shape.nodes);
        out.u32(chunk.shape.parents);
        out.u32(chunk.shape.bricks);
        out.u32(chunk.shape.parent_chunk);
        out.u16(chunk.cone.axis);
        out.i16(chunk.cone.cosine);
        out.u8(chunk.shape.root_depth);
        out.zeros(7);
        for (const StreamEntry &stream : chunk.streams)
            out.u32(pack_stream_entry(stream));
    }
    static_cast<void>(set);
    return out.take();
}

} // namespace pbm
