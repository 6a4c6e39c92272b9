// Decodes the small sections: grid, attributes, materials, lights, texture, ground plane.
#include "pbm_format/container/layout.h"

#include "pbm_format/law/catalogue.h"

#include <algorithm>
#include <cmath>

namespace pbm {

namespace {

constexpr std::size_t kGridBytes = 48;
constexpr std::size_t kAttributeBytes = 24;
constexpr std::size_t kMaterialBytes = 32;
constexpr std::size_t kLightBytes = 48;
constexpr std::size_t kTextureBytes = 32 + 3 * 256;
constexpr std::size_t kGroundBytes = 32; // without texture

bool in_range(float value, float low, float high) { return value >= low && value <= high; }

std::string text_of(const Rgb8 &colour) {
    return std::to_string(colour[0]) + " " + std::to_string(colour[1]) + " " + std::to_string(colour[2]);
}

} // namespace

Result<Grid> decode_grid(ByteView bytes, int depth) {
    if (bytes.size() != kGridBytes)
        return broken("3.4.1", 0, "the grid section is not 48 bytes", kGridBytes, bytes.size());
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
            return broken("3.4.2", 8 * axis, "the grid's corner is not finite", "finite, with the edge added too",
                          grid.origin[axis]);
    if (!std::isnormal(grid.voxel_size) || grid.voxel_size <= 0)
        return broken("3.4.3", 24, "the voxel size is not a positive number", "a positive normal number",
                      grid.voxel_size);
    if (unit > static_cast<std::uint8_t>(Unit::kilometre))
        return broken("3.4.4", 32, "unknown unit", "0..6", unit);
    if (up > static_cast<std::uint8_t>(UpAxis::x))
        return broken("3.4.5", 33, "unknown up axis", "0..2", up);
    if (!in.reserved_clear())
        return broken("3.4.6", 34, "reserved bytes are not zero", 0, in.reserved());
    grid.unit = Unit{unit};
    grid.up = UpAxis{up};
    return grid;
}

Result<AttributeSet> decode_attributes(ByteView bytes, int depth) {
    if (bytes.size() % kAttributeBytes != 0)
        return broken("3.5.1", 0, "the attribute section is not a multiple of 24 bytes", "a multiple of 24",
                      bytes.size());
    AttributeSet set;
    ByteReader in(bytes);
    auto previous = kStreams.begin(); // masks
    std::size_t mandatory = 0;
    while (in.offset() < bytes.size()) {
        const std::size_t at = in.offset();
        const std::uint8_t kind = in.u8(), format = in.u8(), light = in.u8();
        in.zeros(1);
        std::array<std::uint8_t, kMaxDepth + 1> bits{};
        for (auto &level_bits : bits)
            level_bits = in.u8();
        in.zeros(3);
        const auto row = std::find_if(kStreams.begin() + 1, kStreams.end(),
                                      [&](const StreamTraits &traits) { return traits.kind == StreamKind{kind}; });
        if (row == kStreams.end())
            return broken("3.5.2", at, "an attribute this program does not know",
                          "1.." + std::to_string(kStreams.size() - 1), kind);
        const auto stream = StreamKind{kind};
        const bool shadow = stream == StreamKind::shadow;
        if (previous > row || (shadow ? light != set.lights || light >= kMaxLights : previous == row || light != 0))
            return broken("3.5.3", at, "attributes are not in order, or one is there twice",
                          shadow ? "light " + std::to_string(set.lights)
                                 : "after " + std::to_string(static_cast<int>(previous->kind)),
                          shadow ? "light " + std::to_string(light) : std::to_string(kind));
        if (stream == StreamKind::colour ? format < 1 || format > 2 : format != 0)
            return broken("3.5.4", at + 1, "an attribute format this program does not know",
                          stream == StreamKind::colour ? "1..2" : "0", format);
        for (std::size_t level = 0; level < bits.size(); ++level) {
            const bool used = shadow && static_cast<int>(level) <= depth;
            if (used ? !std::has_single_bit(bits[level]) || bits[level] > 8 : bits[level] != 0)
                return broken("3.5.5", at + 4 + level, "bits of a lit fraction are not 1, 2, 4 or 8",
                              used ? "1, 2, 4 or 8" : "0", bits[level]);
        }
        if (!in.reserved_clear())
            return broken("3.5.6", at, "reserved bytes are not zero", 0, in.reserved());
        previous = row;
        if (shadow)
            set.shadow_bits[static_cast<std::size_t>(set.lights++)] = bits;
        else if (stream == StreamKind::colour)
            set.colour = ColourFormat{format};
        else if (row->flag != nullptr)
            set.*row->flag = true;
        else
            ++mandatory;
    }
    if (mandatory != 2)
        return broken("3.5.7", 0, "normal or radius is missing");
    return set;
}

Result<std::vector<Material>> decode_materials(ByteView bytes) {
    if (bytes.empty() || bytes.size() % kMaterialBytes != 0 || bytes.size() / kMaterialBytes > kMaxMaterials)
        return broken("3.6.1", 0, "the material section does not hold 1 to 8 materials of 32 bytes", "32 x 1..8",
                      bytes.size());
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
        for (const float coefficient : {material.ka, material.kd, material.ks})
            if (!in_range(coefficient, 0, 1))
                return broken("3.6.2", at, "a reflection coefficient is not 0..1", "0..1", coefficient);
        if (!in_range(material.power, 1e-6F, 1024))
            return broken("3.6.3", at + 12, "a specular exponent is not above 0 and at most 1,024", "1e-6..1024",
                          material.power);
        if (!in_range(material.environment, 0, 1))
            return broken("3.6.4", at + 20, "an environment blending factor is not 0..1", "0..1", material.environment);
        if (!in.reserved_clear())
            return broken("3.6.5", at + 19, "reserved bytes are not zero", 0, in.reserved());
        materials.push_back(material);
    }
    return materials;
}

// A reader takes a shape that it does not know as a disc, and ignores the last six bytes.
Result<std::vector<Material>> decode_shapes(ByteView bytes, std::vector<Material> materials) {
    if (bytes.size() != kShapeBytes * materials.size())
        return broken("18.2.1", 0, "the shapes section does not hold 8 bytes for each material",
                      kShapeBytes * materials.size(), bytes.size());
    for (std::size_t i = 0; i < materials.size(); ++i) {
        const ByteView record = slice(bytes, kShapeBytes * i, kShapeBytes);
        materials[i].shape = PointShape{record[0]} == PointShape::round ? PointShape::round : PointShape::disc;
        materials[i].tint = record[1];
    }
    return materials;
}

Result<std::vector<Light>> decode_lights(ByteView bytes) {
    if (bytes.empty() || bytes.size() % kLightBytes != 0 || bytes.size() / kLightBytes > kMaxLights)
        return broken("3.7.1", 0, "the light section does not hold 1 to 8 lights of 48 bytes", "48 x 1..8",
                      bytes.size());
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
            return broken("3.7.2", at, "unknown kind of light", "0..2", kind);
        light.kind = LightKind{kind};
        for (const float component : light.intensity)
            if (!in_range(component, 0, 1e6F))
                return broken("3.7.3", at + 4, "a light's intensity is not 0..1,000,000", "0..1000000", component);
        for (const float component : light.position)
            if (!std::isfinite(component))
                return broken("3.7.4", at + 16, "a light's position is not finite", "finite", component);
        const auto &d = light.direction;
        const float length_squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        if (!in_range(length_squared, 0.998F, 1.002F))
            return broken("3.7.5", at + 28, "a light's direction is not of unit length", "0.998..1.002",
                          length_squared);
        if (!in_range(light.exponent, 0, 1024))
            return broken("3.7.6", at + 40, "a spot exponent is not 0..1,024", "0..1024", light.exponent);
        if (!in.reserved_clear())
            return broken("3.7.7", at + 1, "reserved bytes are not zero", 0, in.reserved());
        lights.push_back(light);
    }
    return lights;
}

Result<SolidTexture> decode_texture(ByteView bytes) {
    if (bytes.size() != kTextureBytes)
        return broken("3.8.1", 0, "the texture section is not 800 bytes", kTextureBytes, bytes.size());
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
        return broken("3.8.2", 0, "unknown kind of texture", "1..2", kind);
    if (!in_range(texture.scale, 1e-9F, 1e9F))
        return broken("3.8.3", 8, "texture scale or turbulence out of range", "scale 1e-9..1e9", texture.scale);
    if (!in_range(texture.turbulence, 0, 1e6F))
        return broken("3.8.3", 8, "texture scale or turbulence out of range", "turbulence 0..1e6", texture.turbulence);
    if (!in.reserved_clear())
        return broken("3.8.4", 1, "reserved bytes are not zero", 0, in.reserved());
    texture.kind = TextureKind{kind};
    return texture;
}

Result<GroundPlane> decode_ground_plane(ByteView bytes) {
    if (bytes.size() != kGroundBytes && bytes.size() != kGroundBytes + kTextureBytes)
        return broken("3.11.1", 0, "the ground plane is not 32 bytes, nor 832 with a texture", "32 or 832",
                      bytes.size());
    ByteReader in(bytes);
    GroundPlane ground;
    for (float &coordinate : ground.centre)
        coordinate = in.f32();
    ground.half_edge = in.f32();
    ground.material = in.u8();
    in.zeros(15);
    for (const float coordinate : ground.centre)
        if (!std::isfinite(coordinate))
            return broken("3.11.2", 0, "the centre of the ground plane is not finite", "finite", coordinate);
    if (!std::isnormal(ground.half_edge) || ground.half_edge <= 0)
        return broken("3.11.3", 12, "half the edge of the ground plane is not a positive number",
                      "a positive normal number", ground.half_edge);
    if (!in.reserved_clear())
        return broken("3.11.4", 17, "reserved bytes are not zero", 0, in.reserved());
    if (bytes.size() == kGroundBytes)
        return ground;
    Result<SolidTexture> texture = decode_texture(bytes.subspan(kGroundBytes));
    if (!texture) {
        texture.error().offset += kGroundBytes;
        return std::move(texture).error();
    }
    ground.texture = *texture;
    return ground;
}

Status check_rasters(const ModelParameters &parameters, bool ground_texture, std::size_t lit) {
    const bool wanted = parameters.ground && parameters.ground->texture;
    if (ground_texture != wanted)
        return broken("3.9.5", 0, "the ground plane's texture and its raster need each other",
                      wanted ? "a raster" : "none", ground_texture ? "a raster" : "none");
    if (lit != 0 && (!parameters.ground || lit != static_cast<std::size_t>(parameters.attributes.lights)))
        return broken("3.9.6", 0, "lit fractions of a ground plane are not those of every light with a shadow stream",
                      parameters.ground ? Value(parameters.attributes.lights) : Value("no ground plane"),
                      lit > kMaxLights ? Value("a gap") : Value(lit));
    return {};
}

Status check_parameters(const ModelParameters &parameters) {
    if (parameters.attributes.lights > static_cast<int>(parameters.lights.size()))
        return broken("3.9.1", 0, "a shadow stream belongs to no light",
                      "at most " + std::to_string(parameters.lights.size()), parameters.attributes.lights);
    if (parameters.attributes.texture != !parameters.texture.empty())
        return broken("3.9.2", 0, "texture values and the texture section need each other",
                      parameters.attributes.texture ? "a texture section" : "none",
                      parameters.texture.empty() ? "none" : "a texture section");
    const std::optional<GroundPlane> &ground = parameters.ground;
    const std::size_t used = ground && ground->material == 1 ? 2 : 1; // without a material stream
    if (!parameters.attributes.material && parameters.materials.size() > used)
        return broken("3.9.3", 0, "a material that neither a material stream nor the ground plane can use", used,
                      parameters.materials.size());
    if (ground && ground->material >= parameters.materials.size())
        return broken("3.9.4", 0, "the material of the ground plane does not exist",
                      "below " + std::to_string(parameters.materials.size()), ground->material);
    return {};
}

Status check_parameters(const ModelParameters &parameters, std::span<const SectionEntry> sections) {
    bool ground_texture = false;
    std::size_t lit = 0;
    for (const SectionEntry &entry : sections) {
        ground_texture |= entry.type == SectionType::ground_texture;
        if (entry.type == SectionType::ground_lit) // a gap counts as too many lights
            lit = entry.instance == lit ? lit + 1 : kMaxLights + 1;
    }
    Status status = check_parameters(parameters);
    if (status)
        status = check_rasters(parameters, ground_texture, lit);
    if (!status)
        status.error().offset += find_section(sections, SectionType::attributes)->offset;
    return status;
}

Status check_root(const RootRecord &root, const ModelParameters &parameters) {
    constexpr std::uint64_t kAt = 88; // of the record in the file
    const AttributeSet &set = parameters.attributes;
    if ((root.normal() & ~(kNormalIndexMask | kTwoSidedBit)) != 0)
        return broken("2.13", kAt, "the root's normal has reserved bits", "below 16384", root.normal());
    const Rgb8 colour = root.colour(), rounded = expand_565(pack_565(colour));
    if (set.colour != ColourFormat::rgb888 && (set.colour == ColourFormat::none || rounded != colour) &&
        colour != Rgb8{})
        return broken("2.14", kAt + 2, "the root's colour is not of the file's colour format",
                      text_of(set.colour == ColourFormat::none ? Rgb8{} : rounded), text_of(colour));
    for (const StreamInfo &stream : point_streams()) {
        const StreamTraits &traits = traits_of(stream.kind);
        const bool material = stream.kind == StreamKind::material, present = bytes_per_point(stream, set) != 0;
        const std::size_t limit = material  ? parameters.materials.size()
                                  : present ? std::size_t{1} << std::min(bits_per_point(stream, set, 0), 8U)
                                            : 1;
        const std::uint8_t value = root.value(stream);
        if (value < limit || stream.kind == StreamKind::colour)
            continue;
        const std::uint64_t at = kAt + traits.root_at + stream.light;
        const std::string below = "below " + std::to_string(limit);
        return material ? broken("2.15", at, "the root's material does not exist", below, value)
               : stream.kind == StreamKind::shadow
                   ? broken("2.17", at, "the root's lit fraction is out of range", below, value)
                   : broken("2.16", at, "the root has a " + std::string(traits.value_name) + ", the file has none", 0,
                            value);
    }
    return {};
}

} // namespace pbm
