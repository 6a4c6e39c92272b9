// Images on triangles become the colours of points.
#include "pbm_build/images/triangle_texture.h"
#include "pbm_format/model/point_values.h"
#include "unit/build/built_models.h"
#include "unit/support/value_of.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace {

using namespace pbm;
using namespace pbm::build;
using test::at_depth;
using test::built;
using test::file_of;

using Texel = std::array<std::uint8_t, 4>;

// `colour(x, y)` of a texel.
template <class Colour> Texture texture(std::uint32_t width, std::uint32_t height, const Colour &colour) {
    Texture made{.width = width, .height = height, .texels = {}};
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x)
            made.texels.push_back(colour(x, y));
    return made;
}

// The square [0, 1]^2 in the plane z = 0, seen from above, whose corners are those of the image.
Surface square(Texture image) {
    Surface surface;
    surface.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    surface.triangles = {{0, 1, 2}, {0, 2, 3}};
    surface.texture_corners = {{glm::vec2(0, 1), glm::vec2(1, 1), glm::vec2(1, 0)},
                               {glm::vec2(0, 1), glm::vec2(1, 0), glm::vec2(0, 0)}};
    surface.texture_ids = {0, 0};
    surface.textures.push_back(std::move(image));
    return surface;
}

struct Point {
    double x, y;
    Rgb8 colour;
};

// The points of a model of the square.
std::vector<Point> points_of(const Model &model) {
    std::vector<Point> points;
    const Grid &grid = model.parameters.grid;
    std::vector<MortonCode> codes{0};
    for (std::size_t level = 1; level < model.levels.size(); ++level)
        codes = value_of(expand_level(codes, model.levels[level].masks, model.levels[level].points.size()));
    const PointAttributes &attributes = model.levels.back().points;
    for (std::size_t i = 0; i < codes.size(); ++i) {
        const auto corner = morton_decode(codes[i]);
        points.push_back({grid.origin[0] + (corner[0] + 0.5) * grid.voxel_size,
                          grid.origin[1] + (corner[1] + 0.5) * grid.voxel_size,
                          {attributes.colours[3 * i], attributes.colours[3 * i + 1], attributes.colours[3 * i + 2]}});
    }
    return points;
}

TEST(FaceColours, EachPointHasThatOfItsFace) {
    Surface surface = square({});
    surface.textures.clear();
    surface.texture_ids.clear();
    surface.texture_corners.clear();
    surface.face_colours = {{{250, 0, 0}, true}, {{0, 0, 250}, true}};
    const std::vector<Point> points = points_of(built(surface, at_depth(6)));
    ASSERT_GT(points.size(), 900U);
    for (const Point &p : points)
        if (std::abs(p.x - p.y) > 0.03) {
            EXPECT_EQ(p.colour, p.x > p.y ? (Rgb8{250, 0, 0}) : (Rgb8{0, 0, 250})) << p.x << " " << p.y;
        }
}

TEST(Images, EachPointHasTheColourOfItsPlace) {
    // Left red, right green; the upper half also blue.
    const auto image = texture(64, 64, [](std::uint32_t x, std::uint32_t y) {
        return Texel{static_cast<std::uint8_t>(x < 32 ? 255 : 0), static_cast<std::uint8_t>(x < 32 ? 0 : 255),
                     static_cast<std::uint8_t>(y < 32 ? 255 : 0), 255};
    });
    Surface surface = square(image);
    surface.textures.front().use.wrap = {Wrap::clamp, Wrap::clamp};
    for (const int depth : {5, 6, 8}) { // two texels per voxel, one, and a quarter
        const std::vector<Point> points = points_of(built(surface, at_depth(depth)));
        ASSERT_GT(points.size(), 900U);
        for (const Point &p : points) {
            constexpr double kBorder = 0.06;
            if (std::abs(p.x - 0.5) < kBorder || std::abs(p.y - 0.5) < kBorder)
                continue;
            const Rgb8 expected{static_cast<std::uint8_t>(p.x < 0.5 ? 255 : 0),
                                static_cast<std::uint8_t>(p.x < 0.5 ? 0 : 255),
                                static_cast<std::uint8_t>(p.y > 0.5 ? 255 : 0)};
            EXPECT_EQ(p.colour, expected) << depth << ": " << p.x << " " << p.y;
        }
    }
}

TEST(Images, FineTexelsAreAveragedInLinearLight) {
    const auto image = texture(512, 512, [](std::uint32_t x, std::uint32_t y) {
        const auto value = static_cast<std::uint8_t>((x + y) % 2 == 0 ? 255 : 0);
        return Texel{value, value, value, 255};
    });
    for (const Point &p : points_of(built(square(image), at_depth(6))))
        EXPECT_NEAR(p.colour[0], 188, 1); // half of the light
}

// The background of an atlas, and what triangles do not show, has no say.
TEST(Images, WhatNoTriangleShowsDoesNotBleedIn) {
    Surface surface = square(texture(512, 512, [](std::uint32_t x, std::uint32_t y) {
        const bool inside = x >= 100 && x < 403 && y >= 100 && y < 403;
        return inside ? Texel{200, 100, 50, 255} : Texel{0, 255, 0, 255};
    }));
    for (TextureCorners &corners : surface.texture_corners)
        for (glm::vec2 &corner : corners) // half a texel inside of the chart
            corner = (glm::vec2(101) + corner * 301.0F) / 512.0F;
    for (const int depth : {5, 6, 7})
        for (const Point &p : points_of(built(surface, at_depth(depth))))
            EXPECT_EQ(p.colour, (Rgb8{200, 100, 50})) << depth << ": " << p.x << " " << p.y;
}

TEST(Images, GoOnBeyondTheirEdgesAsTheySay) {
    EXPECT_EQ(wrapped(-1, 8, Wrap::repeat), 7U);
    EXPECT_EQ(wrapped(17, 8, Wrap::repeat), 1U);
    EXPECT_EQ(wrapped(-1, 8, Wrap::clamp), 0U);
    EXPECT_EQ(wrapped(17, 8, Wrap::clamp), 7U);
    EXPECT_EQ(wrapped(-1, 8, Wrap::mirror), 0U);
    EXPECT_EQ(wrapped(8, 8, Wrap::mirror), 7U);
    EXPECT_EQ(wrapped(17, 8, Wrap::mirror), 1U);
    for (std::int64_t at = -40; at < 40; ++at)
        for (const Wrap wrap : {Wrap::repeat, Wrap::mirror, Wrap::clamp})
            EXPECT_LT(wrapped(at, 7, wrap), 7U);
}

TEST(Images, TrianglesWithoutOneKeepTheirColours) {
    Surface surface = square(texture(4, 4, [](auto, auto) { return Texel{10, 20, 30, 255}; }));
    surface.texture_ids[1] = Surface::kNoTexture;
    surface.colours.assign(4, Rgb8{200, 0, 0});
    for (const Point &p : points_of(built(surface, at_depth(6)))) {
        if (std::abs(p.x - p.y) > 0.1) {
            EXPECT_EQ(p.colour, p.x > p.y ? (Rgb8{10, 20, 30}) : (Rgb8{200, 0, 0}));
        }
    }
    // Without colours: that of their material.
    surface.colours.clear();
    for (const Point &p : points_of(built(surface, at_depth(6))))
        EXPECT_TRUE(p.y - p.x < 0.1 || p.colour == Material{}.colour);
}

TEST(Images, ColoursOfVerticesMultiplyTintedOnes) {
    Surface surface = square(texture(4, 4, [](auto, auto) { return Texel{188, 255, 255, 255}; }));
    surface.colours.assign(4, Rgb8{188, 188, 0});
    surface.textures.front().use.is_tinted = true;
    for (const Point &p : points_of(built(surface, at_depth(6)))) {
        EXPECT_NEAR(p.colour[0], 137, 1); // a quarter of the light
        EXPECT_EQ(p.colour[1], 188);
        EXPECT_EQ(p.colour[2], 0);
    }
}

TEST(Images, TheFileDoesNotDependOnThreadsOrOnTheOrderOfTriangles) {
    std::mt19937 random(3);
    Surface surface = square(texture(300, 200, [&](auto, auto) {
        return Texel{static_cast<std::uint8_t>(random()), static_cast<std::uint8_t>(random()),
                     static_cast<std::uint8_t>(random()), 255};
    }));
    BuildOptions options = at_depth(8);
    options.threads = 1;
    const Bytes one = file_of(built(surface, options));
    options.threads = 5;
    EXPECT_EQ(one, file_of(built(surface, options)));
    std::swap(surface.triangles[0], surface.triangles[1]);
    std::swap(surface.texture_corners[0], surface.texture_corners[1]);
    EXPECT_EQ(one, file_of(built(surface, options)));
}

TEST(Images, SurfacesThatAreMergedKeepTheirs) {
    Surface left = square(texture(4, 4, [](auto, auto) { return Texel{10, 20, 30, 255}; }));
    Surface right = square(texture(4, 4, [](auto, auto) { return Texel{200, 100, 0, 255}; }));
    for (glm::dvec3 &p : right.positions)
        p.x += 2;
    Surface plain = square({});
    plain.textures.clear();
    plain.texture_ids.clear();
    plain.texture_corners.clear();
    for (glm::dvec3 &p : plain.positions)
        p.x += 4;
    for (const Point &p : points_of(built({left, plain, right}, at_depth(7))))
        EXPECT_EQ(p.colour, p.x < 1.5 ? (Rgb8{10, 20, 30}) : p.x < 3.5 ? (Rgb8{200, 100, 0}) : Material{}.colour);
}

TEST(Images, ManyTexelsPerVoxelMakeTheGridFiner) {
    const auto grey = [](auto, auto) { return Texel{99, 99, 99, 255}; };
    const auto depth_with = [&](std::uint32_t size) {
        BuildStatistics said;
        Surface surface = square(texture(size, size, grey));
        for (int i = 0; i < 3; ++i) // the bytes of so many triangles keep the grid as coarse as the edges are
            for (std::size_t k = 0; k < 2; ++k) {
                surface.triangles.push_back(surface.triangles[k]);
                surface.texture_corners.push_back(surface.texture_corners[k]);
                surface.texture_ids.push_back(surface.texture_ids[k]);
            }
        const Model model = built(surface, {}, &said);
        const bool told = std::any_of(said.attributes.begin(), said.attributes.end(), [](const AttributeReport &line) {
            return line.name == "depth" && line.note.find("texels") != std::string::npos;
        });
        EXPECT_EQ(told, model.parameters.grid.depth > 8);
        return model.parameters.grid.depth;
    };
    EXPECT_EQ(depth_with(256), 8);
    EXPECT_EQ(depth_with(500), 8); // 3.8 texels in a voxel
    EXPECT_EQ(depth_with(540), 9); // 4.4
    EXPECT_EQ(depth_with(700), 9);
    EXPECT_EQ(depth_with(1500), 10);
    EXPECT_EQ(depth_with(4000), 10);
}

TEST(Images, TransparentTexelsCutHoles) {
    // Opaque in a disc around the middle.
    const auto image = texture(256, 256, [](std::uint32_t x, std::uint32_t y) {
        const double dx = x - 127.5, dy = y - 127.5;
        const bool inside = dx * dx + dy * dy < 100 * 100;
        return inside ? Texel{9, 8, 7, 200} : Texel{255, 0, 255, 10};
    });
    Surface surface = square(image);
    for (const int depth : {6, 8, 9}) { // also where a voxel is smaller than a texel
        surface.textures.front().use.least_opacity = 0.5F;
        const std::vector<Point> points = points_of(built(surface, at_depth(depth)));
        const double whole = std::ldexp(1.0, 2 * depth), share = static_cast<double>(points.size()) / whole;
        EXPECT_NEAR(share, 3.14159 * 100 * 100 / (256 * 256), 0.02) << depth;
        for (const Point &p : points) {
            EXPECT_LT(std::hypot(p.x - 0.5, p.y - 0.5), 0.42);
            EXPECT_EQ(p.colour, (Rgb8{9, 8, 7}));
        }
        surface.textures.front().use.least_opacity = 0;
        EXPECT_GE(points_of(built(surface, at_depth(depth))).size(), static_cast<std::size_t>(whole));
    }
    surface.textures.front().use.least_opacity = 1;
    EXPECT_EQ(test::refused(surface, at_depth(6)).code, ErrorCode::bad_input);
}

// Opaque left of the middle.
Texture half_opaque(std::uint8_t other) {
    return texture(64, 64, [&](std::uint32_t x, auto) {
        return x < 32 ? Texel{9, 8, 7, 255} : Texel{255, 255, 255, other};
    });
}

std::size_t lines_named(const BuildStatistics &said, const std::string &name) {
    return static_cast<std::size_t>(std::count_if(said.attributes.begin(), said.attributes.end(),
                                                  [&](const AttributeReport &line) { return line.name == name; }));
}

TEST(Images, BlendedOnesCutHolesWhereTheyShowTexelsOnBothSides) {
    constexpr std::size_t kWhole = 64 * 64;
    Surface surface = square(half_opaque(20));
    TextureUse &use = surface.textures.front().use;
    use = {.wrap = {Wrap::clamp, Wrap::clamp}, .least_opacity = kUsualAlphaCutoff, .is_blended = true};
    BuildStatistics said;
    const std::vector<Point> points = points_of(built(surface, at_depth(6), &said));
    EXPECT_NEAR(static_cast<double>(points.size()), kWhole / 2.0, 64);
    for (const Point &p : points)
        EXPECT_EQ(p.colour, (Rgb8{9, 8, 7})); // none of the colour of holes
    EXPECT_EQ(lines_named(said, "transparent texels"), 1U);

    // The same image, whose opaque half no triangle shows: glass.
    Surface glass = surface;
    for (TextureCorners &corners : glass.texture_corners)
        for (glm::vec2 &corner : corners)
            corner.x = 0.6F + 0.4F * corner.x;
    BuildStatistics of_glass;
    EXPECT_GE(points_of(built(glass, at_depth(6), &of_glass)).size(), kWhole);
    EXPECT_EQ(lines_named(of_glass, "opacity of images"), 1U);
    BuildOptions strict = at_depth(6);
    strict.strict = true;
    EXPECT_EQ(test::refused(glass, strict).code, ErrorCode::bad_input);

    // Nothing is clear, as in lenses of changing tint.
    Surface lens = square(half_opaque(60));
    lens.textures.front().use = use;
    EXPECT_GE(points_of(built(lens, at_depth(6))).size(), kWhole);

    // The factor of the material makes all of it glass.
    use.opacity = 0.4F;
    EXPECT_GE(points_of(built(surface, at_depth(6))).size(), kWhole);
    use.is_blended = false; // a mask
    EXPECT_EQ(test::refused(surface, at_depth(6)).code, ErrorCode::bad_input);
}

TEST(Images, TheOptionSaysWhichTexelsAreHoles) {
    constexpr std::size_t kWhole = 64 * 64;
    Surface surface = square(half_opaque(100)); // an opaque material
    BuildOptions options = at_depth(6);
    EXPECT_GE(points_of(built(surface, options)).size(), kWhole);
    options.alpha_cutoff = 0.3;
    EXPECT_GE(points_of(built(surface, options)).size(), kWhole);
    options.alpha_cutoff = 0.4;
    EXPECT_LT(points_of(built(surface, options)).size(), kWhole * 5 / 8);
    surface.textures.front().use.least_opacity = 0.9F; // a mask
    options.alpha_cutoff = 0.3;
    EXPECT_GE(points_of(built(surface, options)).size(), kWhole);
    options.alpha_cutoff = 0;
    surface.textures.front().use.opacity = 0.1F;
    EXPECT_GE(points_of(built(surface, options)).size(), kWhole);
}

TEST(Images, OpacitiesOfVerticesCountWhereAnImageCuts) {
    constexpr double kWhole = 64 * 64;
    // 1 at the left, 0 at the right; the image has a half.
    for (const auto &[opacity, share] : {std::pair<std::uint8_t, double>{255, 0.5}, {191, 0.333}, {160, 0.203}}) {
        Surface surface = square(texture(8, 8, [&, alpha = opacity](auto, auto) { return Texel{9, 8, 7, alpha}; }));
        surface.transparencies = {0, 255, 255, 0};
        for (const int depth : {6, 2 * 4}) { // also where a voxel is much smaller than a texel
            EXPECT_GE(static_cast<double>(points_of(built(surface, at_depth(6))).size()), kWhole);
            Surface masked = surface;
            masked.textures.front().use.least_opacity = 0.5F;
            const double whole = std::ldexp(1.0, 2 * depth);
            EXPECT_NEAR(static_cast<double>(points_of(built(masked, at_depth(depth))).size()) / whole, share, 0.03)
                << int{opacity} << ", " << depth;
        }
    }
}

TEST(Images, IgnoredWithTheColoursOfPoints) {
    BuildOptions options = at_depth(6);
    options.scene.ignore_point_colours = true;
    const Model model = built(square(texture(4, 4, [](auto, auto) { return Texel{1, 2, 3, 255}; })), options);
    EXPECT_EQ(model.parameters.attributes.colour, ColourFormat::none);
}

} // namespace
