#include "random_models/random_model.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>

namespace pbm::test {

namespace {

// Mostly between the bounds, seldom a bound.
float random_float(Random &random, float low, float high) {
    switch (random.below(8)) {
    case 0: return low;
    case 1: return high;
    default: return std::clamp(low + (high - low) * static_cast<float>(random.unit()), low, high);
    }
}

Rgb8 random_colour(Random &random) {
    const std::uint64_t bits = random.next();
    return {static_cast<std::uint8_t>(bits), static_cast<std::uint8_t>(bits >> 8),
            static_cast<std::uint8_t>(bits >> 16)};
}

Grid random_grid(Random &random, int depth) {
    Grid grid{.depth = depth};
    for (double &coordinate : grid.origin)
        switch (random.below(6)) {
        case 0: coordinate = 0; break;
        case 1: coordinate = 5.4e6 + random.unit(); break; // UTM
        case 2: coordinate = once_in(random, 20) ? -1e300 : -1e9 * random.unit(); break;
        default: coordinate = 200 * random.unit() - 100;
        }
    const int exponent =
        once_in(random, 20) ? static_cast<int>(random.below(1200)) - 600 : static_cast<int>(random.below(20)) - 14;
    grid.voxel_size = std::ldexp(1 + random.unit(), exponent);
    grid.unit = static_cast<Unit>(random.below(7));
    grid.up = static_cast<UpAxis>(random.below(3));
    return grid;
}

AttributeSet random_attributes(Random &random, int depth) {
    AttributeSet set;
    set.colour = static_cast<ColourFormat>(random.below(3));
    set.material = once_in(random, 2);
    set.texture = once_in(random, 3);
    set.lights =
        once_in(random, 2) ? static_cast<int>(random.below(3)) : static_cast<int>(random.below(kMaxLights + 1));
    for (std::size_t light = 0; light < static_cast<std::size_t>(set.lights); ++light)
        for (std::size_t level = 0; level <= static_cast<std::size_t>(depth); ++level)
            set.shadow_bits[light][level] = static_cast<std::uint8_t>(1U << random.below(4));
    return set;
}

Material random_material(Random &random) {
    return {.ka = random_float(random, 0, 1),
            .kd = random_float(random, 0, 1),
            .ks = random_float(random, 0, 1),
            .power = random_float(random, 1e-6F, 1024),
            .colour = random_colour(random),
            .environment = random_float(random, 0, 1)};
}

Light random_light(Random &random, const Grid &grid) {
    Light light;
    light.kind = static_cast<LightKind>(random.below(3));
    const float most = once_in(random, 10) ? 1e6F : 2.0F;
    for (float &channel : light.intensity)
        channel = random_float(random, 0, most);
    for (float &coordinate : light.position)
        coordinate = static_cast<float>(std::clamp(grid.edge(), 1e-30, 1e30)) * random_float(random, -3, 3);
    const std::array<double, 3> &n = normal_table()[random.below(kNormalCount)];
    for (std::size_t axis = 0; axis < 3; ++axis)
        light.direction[axis] = static_cast<float>(n[axis]);
    light.exponent = random_float(random, 0, 1024);
    return light;
}

SolidTexture random_texture(Random &random) {
    SolidTexture texture{.kind = once_in(random, 2) ? TextureKind::marble : TextureKind::wood,
                         .seed = static_cast<std::uint32_t>(random.next()),
                         .scale = random_float(random, 1e-9F, 1e9F),
                         .turbulence = random_float(random, 0, 1e6F),
                         .palette = {}};
    for (Rgb8 &colour : texture.palette)
        colour = random_colour(random);
    return texture;
}

Image random_image(Random &random, std::uint32_t width, std::uint32_t height, std::uint32_t channels) {
    if (once_in(random, 2))
        return test_image(width, height, channels);
    Image image{.width = width, .height = height, .channels = channels, .texels = {}};
    image.texels.resize(std::size_t{width} * height * channels, static_cast<std::uint8_t>(random.next()));
    if (once_in(random, 2))
        for (std::uint8_t &texel : image.texels)
            texel = static_cast<std::uint8_t>(random.next());
    return image;
}

// 1 .. 16 texels, seldom enough for several tiles.
std::uint32_t random_edge(Random &random) {
    return 1U << (once_in(random, 16) ? 5 + random.below(3) : random.below(5));
}

void add_random_ground(Random &random, Model &model) {
    ModelParameters &parameters = model.parameters;
    GroundPlane ground;
    for (float &coordinate : ground.centre)
        coordinate = random_float(random, -1, 1) * static_cast<float>(std::clamp(parameters.grid.edge(), 1e-30, 1e30));
    ground.half_edge =
        static_cast<float>(std::clamp(parameters.grid.edge(), 1e-30, 1e30)) * (1 + random_float(random, 0, 4));
    if (!parameters.attributes.material && once_in(random, 2)) // a material of its own
        parameters.materials.push_back(random_material(random));
    ground.material = static_cast<std::uint8_t>(
        parameters.attributes.material ? random.below(parameters.materials.size()) : parameters.materials.size() - 1);
    if (once_in(random, 2)) {
        ground.texture = random_texture(random);
        const std::uint32_t edge = random_edge(random);
        model.images.ground_texture = random_image(random, edge, edge, 1);
    }
    if (once_in(random, 2))
        for (int light = 0; light < parameters.attributes.lights; ++light) {
            const std::uint32_t edge = random_edge(random);
            model.images.ground_lit.push_back(random_image(random, edge, edge, 1));
        }
    parameters.ground = ground;
}

using Json = nlohmann::json;

std::string random_text(Random &random) {
    constexpr std::array<const char *, 10> kPieces{"a",  "name",   " ",      "\"",         "\\",
                                                   "\n", "\u00e9", "\u6f22", "\U0001F600", "\x7f"};
    std::string text;
    for (std::uint64_t pieces = random.below(6); pieces > 0; --pieces)
        text += kPieces[random.below(kPieces.size())];
    return text;
}

Json random_value(Random &random, int nesting) {
    switch (random.below(nesting > 0 ? 8 : 6)) {
    case 0: return nullptr;
    case 1: return once_in(random, 2);
    case 2: return static_cast<std::int64_t>(random.next());
    case 3: return std::ldexp(random.unit() - 0.5, static_cast<int>(random.below(2000)) - 1000);
    case 4:
    case 5: return random_text(random);
    case 6: {
        Json array = Json::array();
        for (std::uint64_t values = random.below(4); values > 0; --values)
            array.push_back(random_value(random, nesting - 1));
        return array;
    }
    default: {
        Json object = Json::object();
        for (std::uint64_t values = random.below(4); values > 0; --values)
            object[random_text(random)] = random_value(random, nesting - 1);
        return object;
    }
    }
}

std::string random_metadata(Random &random) {
    constexpr std::size_t kMaxBytes = 4096;
    Json object = Json::object();
    for (std::uint64_t values = random.below(5); values > 0; --values)
        object[random_text(random)] = random_value(random, static_cast<int>(random.below(6)));
    if (once_in(random, 10)) { // maximum nesting: arrays inside the object
        Json deep = Json::array();
        for (int level = 2; level < 32; ++level)
            deep = Json::array({deep});
        object["deep"] = deep;
    }
    std::string text = object.dump(once_in(random, 3) ? 2 : -1, ' ', once_in(random, 2));
    if (text.size() > kMaxBytes)
        return "{}";
    if (once_in(random, 10)) // maximum length
        text += std::string(kMaxBytes - text.size(), ' ');
    return text;
}

// Fields and the values of the finest points: none, equal, rising or any.
void add_random_fields(Random &random, Model &model) {
    const std::size_t count = random.below(3) == 0 ? 1 + random.below(kMaxFields) : 1;
    Level &finest = model.levels.back();
    for (std::size_t f = 0; f < count; ++f) {
        Field field;
        field.name = std::to_string(f);
        field.bytes = static_cast<std::uint8_t>(1 + random.below(2));
        field.name += once_in(random, 4)   ? std::string(kMaxFieldName - 1, 'n')
                      : once_in(random, 2) ? " \u00e9\u6f22"
                                           : "";
        field.unit = once_in(random, 3) ? "\u00b5m" : once_in(random, 2) ? std::string(kMaxFieldUnit, 'u') : "";
        field.offset = std::ldexp(random.unit() - 0.5, static_cast<int>(random.below(2000)) - 1000);
        field.scale = std::ldexp(0.5 + random.unit() / 2, static_cast<int>(random.below(1900)) - 1000);
        field.average = static_cast<FieldAverage>(random.below(kFieldAverages));
        const std::uint64_t kind = random.below(4), least = random.below(field.max_stored() + 1);
        Bytes values(finest.points.size() * field.bytes);
        for (std::size_t i = 0; i < finest.points.size(); ++i) {
            const std::uint64_t value = kind == 0   ? least
                                        : kind == 1 ? least + i / 3
                                        : kind == 2 ? (once_in(random, 9) ? least : 0)
                                                    : random.next();
            set_stored_value(values, i, field.bytes, static_cast<std::uint32_t>(value % (field.max_stored() + 1)));
        }
        model.parameters.fields.push_back(std::move(field));
        finest.fields.push_back(std::move(values));
    }
}

// Sides of any points of some levels.
void add_random_sides(Random &random, Model &model) {
    const AttributeSet &set = model.parameters.attributes;
    for (std::size_t level = 1; level < model.levels.size(); ++level) {
        if (once_in(random, 3))
            continue;
        const std::size_t points = model.levels[level].points.size();
        PointAttributes values = random_points(random, std::vector<MortonCode>(2 * points), static_cast<int>(level),
                                               set, model.parameters.materials.size());
        Sides &sides = model.levels[level].sides;
        const std::uint64_t share = 1 + random.below(9);
        for (std::uint32_t i = 0; i < points; ++i)
            if (once_in(random, share))
                sides.points.push_back(i);
        for_columns(
            set,
            [&](const StreamInfo &stream, std::size_t width, auto &to, auto &from) {
                if (stream.kind != StreamKind::radius)
                    to.assign(from.begin(), from.begin() + static_cast<std::ptrdiff_t>(2 * width * sides.size()));
            },
            sides.values, values);
        for (std::uint16_t &normal : sides.values.normals)
            normal &= kNormalIndexMask;
    }
}

// Offsets of any points of some levels.
void add_random_offsets(Random &random, Model &model) {
    for (std::size_t level = 1; level < model.levels.size(); ++level) {
        Offsets &offsets = model.levels[level].offsets;
        const std::uint64_t share = 1 + random.below(9);
        if (once_in(random, 3))
            continue;
        for (std::uint32_t i = 0; i < model.levels[level].points.size(); ++i)
            if (once_in(random, share)) {
                offsets.points.push_back(i);
                offsets.values.push_back(
                    static_cast<std::int8_t>(static_cast<int>(random.below(2 * Offsets::kMost + 1)) - Offsets::kMost));
            }
    }
}

} // namespace

Model random_model(Random &random, std::size_t max_points) {
    Model model;
    ModelParameters &parameters = model.parameters;
    const int depth = kMinDepth + static_cast<int>(random.below(once_in(random, 2) ? 6 : kMaxDepth - kMinDepth + 1));
    parameters.grid = random_grid(random, depth);
    parameters.attributes = random_attributes(random, depth);
    const AttributeSet &set = parameters.attributes;
    for (std::uint64_t count = set.material ? 1 + random.below(kMaxMaterials) : 1; count > 0; --count)
        parameters.materials.push_back(random_material(random));
    const auto streams = static_cast<std::uint64_t>(set.lights);
    for (std::uint64_t count = streams + random.below(kMaxLights + 1 - streams); count > 0; --count)
        parameters.lights.push_back(random_light(random, parameters.grid));
    if (set.texture)
        parameters.texture.push_back(random_texture(random));
    const std::vector<MortonCode> codes =
        random_voxels(random, depth, std::max<std::size_t>(4, max_points >> random.below(6)));
    set_levels(model, codes, random_points(random, codes, depth, set, parameters.materials.size()), 1);
    if (once_in(random, 3))
        add_random_fields(random, model);
    average_fields(model, 1);
    if (once_in(random, 3))
        add_random_sides(random, model);
    if (once_in(random, 3))
        add_random_offsets(random, model);
    if (once_in(random, 2))
        add_random_ground(random, model);
    if (once_in(random, 3)) {
        const std::uint32_t height = random_edge(random);
        model.images.panorama = random_image(random, 2 * height, height, 3);
    }
    parameters.closed = once_in(random, 2);
    if (once_in(random, 3))
        for (Material &material : parameters.materials)
            material.shape = once_in(random, 2) ? PointShape::round : PointShape::disc;
    if (once_in(random, 3))
        for (Material &material : parameters.materials)
            material.tint = static_cast<std::uint8_t>(random.below(256));
    model.metadata = random_metadata(random);
    return model;
}

} // namespace pbm::test
