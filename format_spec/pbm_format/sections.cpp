// The small sections: grid, attributes, materials, lights, texture; and the chunk directories.
#include "pbm_format/layout.h"

#include <algorithm>
#include <cmath>

namespace pbm {

namespace {

constexpr std::size_t kGridBytes = 48;
constexpr std::size_t kAttributeBytes = 24;
constexpr std::size_t kMaterialBytes = 32;
constexpr std::size_t kLightBytes = 48;
constexpr std::size_t kTextureBytes = 32 + 3 * 256;

Error bad_section(std::uint64_t offset, std::string message) {
    return {ErrorCode::bad_section, offset, std::move(message)};
}

bool in_range(float value, float low, float high) { return value >= low && value <= high; }

} // namespace

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

Result<Grid> decode_grid(ByteView bytes, int depth) {
    if (bytes.size() != kGridBytes)
        return bad_section(0, "3.4.1 the grid section is not 48 bytes");
    ByteReader in(bytes);
    Grid grid;
    grid.depth = depth;
    for (double &coordinate : grid.origin)
        coordinate = in.f64();
    grid.voxel_size = in.f64();
    const std::uint8_t unit = in.u8(), up = in.u8();
    in.zeros(14);
    for (std::size_t axis = 0; axis < 3; ++axis)
        if (!std::isfinite(grid.origin[axis]) || !std::isfinite(grid.origin[axis] + grid.edge()))
            return bad_section(8 * axis, "3.4.2 the grid's corner is not finite");
    if (!std::isnormal(grid.voxel_size) || grid.voxel_size <= 0)
        return bad_section(24, "3.4.3 the voxel size is not a positive number");
    if (unit > static_cast<std::uint8_t>(Unit::kilometre))
        return bad_section(32, "3.4.4 unknown unit");
    if (up > static_cast<std::uint8_t>(UpAxis::x))
        return bad_section(33, "3.4.5 unknown up axis");
    if (!in.reserved_clear())
        return bad_section(34, "3.4.6 reserved bytes are not zero");
    grid.unit = Unit{unit};
    grid.up = UpAxis{up};
    return grid;
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

Result<AttributeSet> decode_attributes(ByteView bytes, int depth) {
    if (bytes.size() % kAttributeBytes != 0)
        return bad_section(0, "3.5.1 the attribute section is not a multiple of 24 bytes");
    AttributeSet set;
    ByteReader in(bytes);
    int previous = static_cast<int>(StreamKind::masks);
    std::size_t mandatory = 0;
    while (in.offset() < bytes.size()) {
        const std::size_t at = in.offset();
        const std::uint8_t kind = in.u8(), format = in.u8(), light = in.u8();
        in.zeros(1);
        std::array<std::uint8_t, kMaxDepth + 1> bits{};
        for (auto &level_bits : bits)
            level_bits = in.u8();
        in.zeros(3);
        if (kind < static_cast<int>(StreamKind::normal) || kind > static_cast<int>(StreamKind::shadow))
            return Error{ErrorCode::unsupported_feature, at, "3.5.2 an attribute this program does not know"};
        const auto stream = StreamKind{kind};
        const bool shadow = stream == StreamKind::shadow;
        if (shadow ? previous > kind || light != set.lights || light >= kMaxLights : previous >= kind || light != 0)
            return bad_section(at, "3.5.3 attributes are not in order, or one is there twice");
        if (stream == StreamKind::colour ? format < 1 || format > 2 : format != 0)
            return Error{ErrorCode::unsupported_feature, at + 1,
                         "3.5.4 an attribute format this program does not know"};
        for (std::size_t level = 0; level < bits.size(); ++level) {
            const bool used = shadow && static_cast<int>(level) <= depth;
            if (used ? !std::has_single_bit(bits[level]) || bits[level] > 8 : bits[level] != 0)
                return bad_section(at + 4 + level, "3.5.5 bits of a lit fraction are not 1, 2, 4 or 8");
        }
        if (!in.reserved_clear())
            return bad_section(at, "3.5.6 reserved bytes are not zero");
        previous = kind;
        switch (stream) {
        case StreamKind::colour: set.colour = ColourFormat{format}; break;
        case StreamKind::material: set.material = true; break;
        case StreamKind::texture: set.texture = true; break;
        case StreamKind::shadow: set.shadow_bits[static_cast<std::size_t>(set.lights++)] = bits; break;
        default: ++mandatory; break;
        }
    }
    if (mandatory != 2)
        return bad_section(0, "3.5.7 normal or radius is missing");
    return set;
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

Result<std::vector<Material>> decode_materials(ByteView bytes) {
    if (bytes.empty() || bytes.size() % kMaterialBytes != 0 || bytes.size() / kMaterialBytes > kMaxMaterials)
        return bad_section(0, "3.6.1 the material section does not hold 1 to 8 materials of 32 bytes");
    std::vector<Material> materials;
    ByteReader in(bytes);
    while (in.offset() < bytes.size()) {
        const std::size_t at = in.offset();
        Material material;
        material.ka = in.f32();
        material.kd = in.f32();
        material.ks = in.f32();
        material.power = in.f32();
        for (auto &channel : material.colour)
            channel = in.u8();
        in.zeros(1);
        material.environment = in.f32();
        in.zeros(8);
        if (!in_range(material.ka, 0, 1) || !in_range(material.kd, 0, 1) || !in_range(material.ks, 0, 1))
            return bad_section(at, "3.6.2 a reflection coefficient is not 0..1");
        if (!in_range(material.power, 1e-6F, 1024))
            return bad_section(at + 12, "3.6.3 a specular exponent is not above 0 and at most 1,024");
        if (!in_range(material.environment, 0, 1))
            return bad_section(at + 20, "3.6.4 an environment blending factor is not 0..1");
        if (!in.reserved_clear())
            return bad_section(at + 19, "3.6.5 reserved bytes are not zero");
        materials.push_back(material);
    }
    return materials;
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

Result<std::vector<Light>> decode_lights(ByteView bytes) {
    if (bytes.empty() || bytes.size() % kLightBytes != 0 || bytes.size() / kLightBytes > kMaxLights)
        return bad_section(0, "3.7.1 the light section does not hold 1 to 8 lights of 48 bytes");
    std::vector<Light> lights;
    ByteReader in(bytes);
    while (in.offset() < bytes.size()) {
        const std::size_t at = in.offset();
        Light light;
        const std::uint8_t kind = in.u8();
        in.zeros(3);
        for (auto *vector : {&light.intensity, &light.position, &light.direction})
            for (float &component : *vector)
                component = in.f32();
        light.exponent = in.f32();
        in.zeros(4);
        if (kind > static_cast<std::uint8_t>(LightKind::spot))
            return bad_section(at, "3.7.2 unknown kind of light");
        light.kind = LightKind{kind};
        for (const float component : light.intensity)
            if (!in_range(component, 0, 1e6F))
                return bad_section(at + 4, "3.7.3 a light's intensity is not 0..1,000,000");
        for (const float component : light.position)
            if (!std::isfinite(component))
                return bad_section(at + 16, "3.7.4 a light's position is not finite");
        const auto &d = light.direction;
        const float length_squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        if (!in_range(length_squared, 0.998F, 1.002F))
            return bad_section(at + 28, "3.7.5 a light's direction is not of unit length");
        if (!in_range(light.exponent, 0, 1024))
            return bad_section(at + 40, "3.7.6 a spot exponent is not 0..1,024");
        if (!in.reserved_clear())
            return bad_section(at + 1, "3.7.7 reserved bytes are not zero");
        lights.push_back(light);
    }
    return lights;
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

Result<SolidTexture> decode_texture(ByteView bytes) {
    if (bytes.size() != kTextureBytes)
        return bad_section(0, "3.8.1 the texture section is not 800 bytes");
    ByteReader in(bytes);
    SolidTexture texture;
    const std::uint8_t kind = in.u8();
    in.zeros(3);
    texture.seed = in.u32();
    texture.scale = in.f32();
    texture.turbulence = in.f32();
    in.zeros(16);
    for (Rgb8 &colour : texture.palette)
        for (auto &channel : colour)
            channel = in.u8();
    if (kind != static_cast<std::uint8_t>(TextureKind::marble) && kind != static_cast<std::uint8_t>(TextureKind::wood))
        return bad_section(0, "3.8.2 unknown kind of texture");
    if (!in_range(texture.scale, 1e-9F, 1e9F) || !in_range(texture.turbulence, 0, 1e6F))
        return bad_section(8, "3.8.3 texture scale or turbulence out of range");
    if (!in.reserved_clear())
        return bad_section(1, "3.8.4 reserved bytes are not zero");
    texture.kind = TextureKind{kind};
    return texture;
}

Status check_parameters(const ModelParameters &parameters) {
    if (parameters.attributes.lights > static_cast<int>(parameters.lights.size()))
        return bad_section(0, "3.9.1 a shadow stream belongs to no light");
    if (parameters.attributes.texture != !parameters.texture.empty())
        return bad_section(0, "3.9.2 texture values and the texture section go together");
    if (!parameters.attributes.material && parameters.materials.size() > 1)
        return bad_section(0, "3.9.3 several materials but no material stream");
    return {};
}

Status check_root(const RootRecord &root, const ModelParameters &parameters) {
    const AttributeSet &set = parameters.attributes;
    const auto bad = [](std::uint64_t offset, const char *message) {
        return Error{ErrorCode::bad_header, offset, message};
    };
    if ((root.normal & ~(kNormalIndexMask | kTwoSidedBit)) != 0)
        return bad(88, "2.13 the root's normal has reserved bits");
    if (set.colour != ColourFormat::rgb888 &&
        (set.colour == ColourFormat::none || expand_565(pack_565(root.colour)) != root.colour) && root.colour != Rgb8{})
        return bad(90, "2.14 the root's colour is not of the file's colour format");
    if (root.material >= parameters.materials.size())
        return bad(93, "2.15 the root's material does not exist");
    if (!set.texture && root.texture != 0)
        return bad(95, "2.16 the root has a texture value, the file has none");
    for (std::size_t light = 0; light < kMaxLights; ++light) {
        const unsigned bits = static_cast<int>(light) < set.lights ? set.shadow_bits[light][0] : 0U;
        if (root.shadow[light] >= 1U << bits)
            return bad(96 + light, "2.17 the root's lit fraction is out of range");
    }
    return {};
}

std::size_t chunk_entry_bytes(const AttributeSet &set) { return kChunkEntryFixedBytes + 4 * streams_of(set).size(); }

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
            out.u32(stream.stored_bytes | static_cast<std::uint32_t>(stream.filter) << 24 |
                    (stream.zstd ? 1U << 31 : 0U));
    }
    static_cast<void>(set);
    return out.take();
}

namespace {

ChunkEntry read_chunk_entry(ByteReader &in, std::size_t stream_count) {
    ChunkEntry chunk;
    chunk.shape.root_prefix = in.u64();
    chunk.hash = in.u64();
    chunk.shape.points = in.u32();
    chunk.shape.nodes = in.u32();
    chunk.shape.parents = in.u32();
    chunk.shape.bricks = in.u32();
    chunk.shape.parent_chunk = in.u32();
    chunk.cone.axis = in.u16();
    chunk.cone.cosine = in.i16();
    chunk.shape.root_depth = in.u8();
    in.zeros(7);
    chunk.streams.resize(stream_count);
    for (StreamEntry &stream : chunk.streams) {
        const std::uint32_t packed = in.u32();
        stream.stored_bytes = packed & 0xFFFFFF;
        stream.filter = static_cast<std::uint8_t>(packed >> 24 & 0x7F);
        stream.zstd = packed >> 31 != 0;
    }
    return chunk;
}

// Rules of one entry that need nothing but the level and N. BVG.md 5.3
Status check_chunk_entry(const ChunkEntry &chunk, int level, std::uint32_t chunk_points, std::uint64_t at) {
    const ChunkShape &shape = chunk.shape;
    const auto bad = [&](std::uint64_t field, const char *message) {
        return Error{ErrorCode::bad_directory, at + field, message};
    };
    if (shape.root_depth > std::max(0, level - 3))
        return bad(40, "5.3.1 the chunk's root is too deep for its level");
    if (shape.root_prefix >> 3 * shape.root_depth != 0)
        return bad(0, "5.3.2 the chunk's root lies outside the grid");
    if (shape.points == 0 || shape.points > chunk_points)
        return bad(16, "5.3.3 the chunk holds no point or more than the limit");
    const auto fits = [](std::uint32_t children, std::uint32_t nodes) {
        return nodes >= 1 && nodes <= children && children <= std::uint64_t{8} * nodes;
    };
    if (!fits(shape.points, shape.nodes))
        return bad(20, "5.3.4 node count is impossible for the point count");
    if (level >= 2 ? !fits(shape.nodes, shape.parents) : shape.parents != 0 || shape.nodes != 1)
        return bad(24, "5.3.5 parent count is impossible for the node count");
    if (level >= 3 ? !fits(shape.parents, shape.bricks) : shape.bricks != 1 || (level == 2 && shape.parents != 1))
        return bad(28, "5.3.6 brick count is impossible for the parent count");
    if (chunk.cone.axis >= kNormalCount || chunk.cone.cosine < kNoCone ||
        (chunk.cone.cosine == kNoCone && chunk.cone.axis != 0))
        return bad(36, "5.3.7 the normal cone is out of range");
    return {};
}

// Sizes of the streams against what they expand to. BVG.md 5.4
Status check_stream_sizes(const ChunkEntry &chunk, int level, const AttributeSet &set, std::uint64_t at) {
    const std::vector<StreamInfo> streams = streams_of(set);
    for (std::size_t s = 0; s < streams.size(); ++s) {
        const StreamEntry &stream = chunk.streams[s];
        const std::uint64_t raw = raw_stream_bytes(streams[s], set, level, chunk.shape.nodes, chunk.shape.points);
        const std::uint64_t here = at + kChunkEntryFixedBytes + 4 * s;
        const std::string name(to_string(streams[s].kind));
        if (stream.filter != 0)
            return Error{ErrorCode::unsupported_feature, here,
                         "5.4.1 " + name + ": a filter this program does not know"};
        if (stream.zstd ? stream.stored_bytes == 0 || stream.stored_bytes >= raw : stream.stored_bytes != raw)
            return Error{ErrorCode::bad_directory, here,
                         "5.4.2 " + name + ": stored size is impossible for the raw size"};
        if (raw / kMaxExpansion > stream.stored_bytes)
            return Error{ErrorCode::too_large, here, "5.4.3 " + name + ": expands more than 32,768 times"};
    }
    return {};
}

} // namespace

Result<LevelDirectory> decode_directory(ByteView bytes, int level, const AttributeSet &set, std::uint32_t chunk_points,
                                        const LevelDirectory *above, const SectionEntry &section) {
    assert((level == 1) == (above == nullptr));
    const std::size_t entry_bytes = chunk_entry_bytes(set);
    if (bytes.empty() || bytes.size() % entry_bytes != 0)
        return Error{ErrorCode::bad_directory, 0, "5.5.1 the directory is not a whole number of entries"};
    const std::size_t count = bytes.size() / entry_bytes;
    const std::vector<StreamInfo> streams = streams_of(set);

    LevelDirectory directory;
    directory.level = level;
    directory.chunks.reserve(count);
    ByteReader in(bytes);
    std::uint64_t offset = 0, raw_bytes = 0;
    std::uint64_t next_place = 0;                      // first finest cell after the chunk before
    std::size_t parent_index = 0;                      // chunk above that is being filled
    std::uint64_t parent_points = 0, parent_nodes = 0; // of it that the chunks so far hold
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint64_t at = in.offset();
        const auto bad = [&](std::uint64_t field, const char *message) {
            return Error{ErrorCode::bad_directory, at + field, message};
        };
        ChunkEntry chunk = read_chunk_entry(in, streams.size());
        if (!in.reserved_clear())
            return bad(41, "5.5.2 reserved bytes are not zero");
        if (const Status status = check_chunk_entry(chunk, level, chunk_points, at); !status)
            return status.error();
        if (const Status status = check_stream_sizes(chunk, level, set, at); !status)
            return status.error();

        const int shift = 3 * (kMaxDepth - chunk.shape.root_depth);
        const std::uint64_t place = chunk.shape.root_prefix << shift;
        if (i > 0 && place < next_place)
            return bad(0, "5.5.3 chunks overlap or are not in Morton order");
        next_place = place + (std::uint64_t{1} << shift);
        if (above == nullptr) {
            if (chunk.shape.parent_chunk != 0 || i > 0)
                return bad(32, "5.5.4 level 1 is one chunk");
        } else {
            if (i > 0 && parent_points == above->chunks[parent_index].shape.points) {
                ++parent_index;
                parent_points = parent_nodes = 0;
            }
            if (parent_index >= above->chunks.size() || chunk.shape.parent_chunk != parent_index)
                return bad(32, "5.5.5 parent chunks are not filled one after the other");
            const ChunkShape &parent = above->chunks[parent_index].shape;
            if (chunk.shape.root_depth < parent.root_depth ||
                chunk.shape.root_prefix >> 3 * (chunk.shape.root_depth - parent.root_depth) != parent.root_prefix)
                return bad(0, "5.5.6 the chunk does not nest in its parent chunk");
            parent_points += chunk.shape.nodes;
            parent_nodes += chunk.shape.parents;
            if (parent_points > parent.points || parent_nodes > parent.nodes ||
                (parent_points == parent.points) != (parent_nodes == parent.nodes))
                return bad(20, "5.5.7 chunks hold more nodes than their parent chunk has points");
        }
        chunk.offset = section.offset + offset;
        chunk.first_point = directory.points;
        chunk.first_node = directory.nodes;
        for (std::size_t s = 0; s < streams.size(); ++s) {
            chunk.stored_bytes += chunk.streams[s].stored_bytes;
            raw_bytes += raw_stream_bytes(streams[s], set, level, chunk.shape.nodes, chunk.shape.points);
        }
        if (chunk.stored_bytes > section.stored_bytes - offset)
            return bad(kChunkEntryFixedBytes, "5.5.8 the chunk lies outside its section");
        offset += chunk.stored_bytes;
        directory.points += chunk.shape.points;
        directory.nodes += chunk.shape.nodes;
        directory.chunks.push_back(std::move(chunk));
    }
    if (above != nullptr &&
        (parent_index + 1 != above->chunks.size() || parent_points != above->chunks.back().shape.points))
        return Error{ErrorCode::bad_directory, bytes.size(), "5.5.9 points of the level above have no masks"};
    if (offset != section.stored_bytes || raw_bytes != section.raw_bytes || directory.points != section.count)
        return Error{ErrorCode::bad_directory, bytes.size(),
                     "5.5.10 sums over the chunks are not those of the section table"};
    return directory;
}

} // namespace pbm
