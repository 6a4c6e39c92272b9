// Small models of analytic shapes, for tests of the format and of its readers.
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_format/model/octree.h"
#include "unit/support/random.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace pbm::test {

// A sphere around the centre; `radius` in edges of the cube. The attributes of `set` have varying values. All levels
// are averaged, so the model can be written.
inline Model sphere_model(int depth, AttributeSet set, double radius = 0.45, std::uint64_t seed = 1) {
    const std::uint32_t edge = 1U << depth;
    std::vector<MortonCode> codes;
    for (MortonCode code = 0; code < MortonCode{1} << 3 * depth; ++code) {
        const auto [x, y, z] = morton_decode(code);
        double nearest = 0, farthest = 0;
        for (const std::uint32_t c : {x, y, z}) {
            const double low = static_cast<double>(c) / edge - 0.5, high = static_cast<double>(c + 1) / edge - 0.5;
            const double inner = low > 0    ? low
                                 : high < 0 ? -high
                                            : 0,
                         outer = std::max(std::fabs(low), std::fabs(high));
            nearest += inner * inner;
            farthest += outer * outer;
        }
        if (nearest <= radius * radius && farthest >= radius * radius)
            codes.push_back(code);
    }
    Model model;
    model.metadata = R"({"generator":"test"})";
    ModelParameters &parameters = model.parameters;
    parameters.grid = {.depth = depth, .origin = {-1, -2, -3}, .voxel_size = 2.0 / edge};
    parameters.attributes = set;
    parameters.materials.resize(set.material ? 3 : 1);
    parameters.lights.resize(static_cast<std::size_t>(set.lights));
    if (set.texture)
        parameters.texture.emplace_back();
    Random random(seed);
    PointAttributes points;
    points.resize(codes.size(), set);
    for (std::size_t i = 0; i < codes.size(); ++i) {
        const auto [x, y, z] = morton_decode(codes[i]);
        points.normals[i] = quantise_normal(x + 0.5 - edge / 2.0, y + 0.5 - edge / 2.0, z + 0.5 - edge / 2.0);
        points.radii[i] = static_cast<std::uint8_t>(
            std::min<int>(kMaxFinestRadius, 255 - 12 * depth - 2 + static_cast<int>(random.below(2)) * 3));
        if (set.colour != ColourFormat::none)
            set_point_colour(points, i, set.colour,
                             {static_cast<std::uint8_t>(255 * x / edge), static_cast<std::uint8_t>(255 * y / edge),
                              static_cast<std::uint8_t>(random.below(256))});
        if (set.material)
            points.materials[i] = static_cast<std::uint8_t>(random.below(3));
        if (set.texture)
            points.textures[i] = static_cast<std::uint8_t>(random.below(256));
        for (std::size_t light = 0; light < static_cast<std::size_t>(set.lights); ++light)
            points.shadows[light][i] = static_cast<std::uint8_t>(
                random.below(std::uint64_t{1} << set.shadow_bits[light][static_cast<std::size_t>(depth)]));
    }
    set_levels(model, std::move(codes), std::move(points), 1);
    return model;
}

// Adds a field of each kind to a model with points: 8 bits of noise, 16 bits that ascend, and labels; a tenth of the
// points lacks the latter two.
inline void add_fields(Model &model) {
    model.parameters.fields = {
        {.name = "noise", .unit = "", .offset = -1, .scale = 0.5, .bytes = 1, .average = FieldAverage::maximum},
        {.name = "height", .unit = "m", .offset = 2, .scale = 0.001, .bytes = 2, .average = FieldAverage::mean},
        {.name = "class", .unit = "", .offset = 0, .scale = 1, .bytes = 1, .average = FieldAverage::majority}};
    Random random(7);
    Level &finest = model.levels.back();
    const std::size_t points = finest.points.size();
    for (const Field &field : model.parameters.fields)
        finest.fields.emplace_back(points * field.bytes);
    for (std::size_t i = 0; i < points; ++i) {
        const bool has_none = random.below(10) == 0;
        set_stored_value(finest.fields[0], i, 1, static_cast<std::uint32_t>(random.below(256)));
        set_stored_value(finest.fields[1], i, 2, has_none ? 0 : static_cast<std::uint32_t>(1 + 3 * i % 60000));
        set_stored_value(finest.fields[2], i, 1, has_none ? 0 : static_cast<std::uint32_t>(1 + random.below(4)));
    }
    average_fields(model, 1);
}

// Gives every third point of the levels above 0 any offset, all points of level 1.
inline void add_offsets(Model &model) {
    Random random(9);
    for (std::size_t level = 1; level < model.levels.size(); ++level) {
        Offsets &offsets = model.levels[level].offsets;
        for (std::uint32_t i = 0; i < model.levels[level].points.size(); i += level == 1 ? 1 : 3) {
            offsets.points.push_back(i);
            offsets.values.push_back(
                static_cast<std::int8_t>(static_cast<int>(random.below(2 * Offsets::kMost + 1)) - Offsets::kMost));
        }
    }
}

// Gives every third point of the levels above 0 two sides of any values, all points of level 1.
inline void add_sides(Model &model) {
    Random random(8);
    const AttributeSet &set = model.parameters.attributes;
    for (std::size_t level = 1; level < model.levels.size(); ++level) {
        Sides &sides = model.levels[level].sides;
        for (std::uint32_t i = 0; i < model.levels[level].points.size(); i += level == 1 ? 1 : 3)
            sides.points.push_back(i);
        sides.values.resize(2 * sides.size(), set);
        sides.values.radii.clear();
        for (std::size_t i = 0; i < 2 * sides.size(); ++i)
            sides.values.normals[i] = static_cast<std::uint16_t>(random.below(kNormalCount));
        for (std::uint8_t &value : sides.values.colours)
            value = static_cast<std::uint8_t>(random.below(256));
        for (std::uint8_t &value : sides.values.materials)
            value = static_cast<std::uint8_t>(random.below(model.parameters.materials.size()));
        for (std::uint8_t &value : sides.values.textures)
            value = static_cast<std::uint8_t>(random.below(256));
        for (std::size_t light = 0; light < static_cast<std::size_t>(set.lights); ++light)
            for (std::uint8_t &value : sides.values.shadows[light])
                value = static_cast<std::uint8_t>(random.below(std::uint64_t{1} << set.shadow_bits[light][level]));
    }
}

// A wall of one layer of voxels across z in the middle of the cube, red above and blue below; each node of coarser
// levels has both sides. `two_layers`: of two layers, one of each colour, so that the finest points are one-sided.
inline Model thin_wall(bool two_layers) {
    constexpr int kWallDepth = 4;
    Model model;
    model.metadata = "{}";
    model.parameters.grid.depth = kWallDepth;
    model.parameters.attributes.colour = ColourFormat::rgb888;
    model.parameters.materials.resize(1);
    const AttributeSet &set = model.parameters.attributes;
    std::vector<MortonCode> codes;
    for (std::uint32_t x = 0; x < 16; ++x)
        for (std::uint32_t y = 0; y < 16; ++y)
            for (std::uint32_t z = 8; z < (two_layers ? 10U : 9U); ++z)
                codes.push_back(morton_encode(x, y, z));
    std::sort(codes.begin(), codes.end());
    PointAttributes points;
    points.resize(codes.size(), set);
    Sides sides;
    sides.values.resize(two_layers ? 0 : 2 * codes.size(), set);
    sides.values.radii.clear();
    const std::uint16_t up = quantise_normal(0, 0, 1), down = quantise_normal(0, 0, -1);
    const Rgb8 red{220, 40, 40}, blue{40, 40, 220};
    for (std::size_t i = 0; i < codes.size(); ++i) {
        const bool is_above = morton_decode(codes[i])[2] == 9;
        points.normals[i] = two_layers ? (is_above ? up : down) : static_cast<std::uint16_t>(up | kTwoSidedBit);
        points.radii[i] = kMaxFinestRadius;
        set_point_colour(points, i, set.colour, two_layers ? (is_above ? red : blue) : Rgb8{160, 40, 160});
        if (two_layers)
            continue;
        sides.points.push_back(static_cast<std::uint32_t>(i));
        sides.values.normals[2 * i] = up;
        sides.values.normals[2 * i + 1] = down;
        set_point_colour(sides.values, 2 * i, set.colour, red);
        set_point_colour(sides.values, 2 * i + 1, set.colour, blue);
    }
    set_levels(model, std::move(codes), std::move(points), 1);
    model.levels.back().sides = std::move(sides);
    return model;
}

// Every attribute there is; light 0 has 1-bit flags at the finest level and 4-bit fractions above, light 1 8 bits.
inline AttributeSet every_attribute(ColourFormat colour, int depth) {
    AttributeSet set{.colour = colour, .material = true, .texture = true, .lights = 2, .shadow_bits = {}};
    for (std::size_t level = 0; level <= static_cast<std::size_t>(depth); ++level) {
        set.shadow_bits[0][level] = level == static_cast<std::size_t>(depth) ? 1 : 4;
        set.shadow_bits[1][level] = 8;
    }
    return set;
}

// Smooth on the left, noise on the right, so that filtered, zstd and raw tiles all occur.
inline Image test_image(std::uint32_t width, std::uint32_t height, std::uint32_t channels) {
    Image image{.width = width, .height = height, .channels = channels, .texels = {}};
    Random random(width + height + channels);
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x)
            for (std::uint32_t c = 0; c < channels; ++c)
                image.texels.push_back(static_cast<std::uint8_t>(x * 100 / width + y * 50 / height + c * 30 +
                                                                 random.below(x < width / 2 ? 4 : 256)));
    return image;
}

// Adds everything a file can hold beside points: a panorama of that height, a textured ground plane, and its lit
// fractions for each light with a shadow stream.
inline void add_surroundings(Model &model, std::uint32_t panorama_height, std::uint32_t ground_edge) {
    ModelParameters &parameters = model.parameters;
    parameters.ground = {.centre = {1, 0, 1}, .half_edge = 3, .material = 0, .texture = SolidTexture{}};
    for (std::size_t i = 0; i < 256; ++i)
        parameters.ground->texture->palette[i] = {static_cast<std::uint8_t>(i), 100, 50};
    model.images.panorama = test_image(2 * panorama_height, panorama_height, 3);
    model.images.ground_texture = test_image(ground_edge, ground_edge, 1);
    for (int light = 0; light < parameters.attributes.lights; ++light)
        model.images.ground_lit.push_back(test_image(ground_edge / 2, ground_edge / 2, 1));
}

} // namespace pbm::test
