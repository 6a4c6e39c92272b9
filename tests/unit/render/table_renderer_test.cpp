// The renderer of tables draws what the plain one draws: to the bit of colours and depths, but where its tables are
// known to be rougher.
#include "pbm_render/tables/table_renderer.h"

#include "pbm_render/appearance/field_colours.h"
#include "pbm_render/camera/unit_grid.h"
#include "pbm_render/tables/facing_table.h"
#include "pbm_render/tables/splat_kernels.h"
#include "pbm_render/tables/transform_table.h"
#include "unit/render/surroundings_test_model.h"

#include <gtest/gtest.h>

#include <bit>
#include <functional>
#include <optional>
#include <string>

namespace pbm {
namespace {

using namespace test;

constexpr int kBallDepth = 6;

// Changes the one radius, of dense parts, for which TableRenderer has shapes that are exact only in the middle of an
// octant.
Model without_dense_radius(Model model) {
    for (std::size_t level = 0; level < model.levels.size(); ++level)
        for (std::uint8_t &radius : model.levels[level].points.radii)
            if (radius == radius_index(std::ldexp(0.87, -static_cast<int>(level))))
                ++radius;
    return model;
}

struct NamedModel {
    std::string name;
    Model model;
};

// A light of each kind, all fixed to the model.
void add_lights(Model &model) {
    model.parameters.lights = {Light{.direction = {0.6F, 0, -0.8F}},
                               Light{.kind = LightKind::point, .intensity = {1, 0.5F, 0.2F}, .position = {2, 1, 1}},
                               Light{.kind = LightKind::spot,
                                     .position = {-2, 0, 2},
                                     .direction = {0.4472136F, -0.4472136F, -0.7745967F},
                                     .exponent = 3}};
}

// Balls in a cube of edge 2 around (0, -1, -2), with all kinds of colours, lights and surroundings.
std::vector<NamedModel> make_ball_models() {
    std::vector<NamedModel> models;
    models.push_back({"grey", smooth_ball(kBallDepth, {})});
    models.push_back({"colours of 888", smooth_ball(kBallDepth, {.colour = ColourFormat::rgb888})});
    models.push_back({"colours of 565", smooth_ball(kBallDepth, {.colour = ColourFormat::rgb565})});
    models.push_back({"materials and a light of each kind", smooth_ball(kBallDepth, {.material = true})});
    add_lights(models.back().model);
    models.push_back(
        {"texture and shadows", smooth_ball(kBallDepth, every_attribute(ColourFormat::rgb888, kBallDepth))});
    Model &rich = models.back().model;
    for (std::size_t i = 0; i < rich.parameters.texture.front().palette.size(); ++i)
        rich.parameters.texture.front().palette[i] = {static_cast<std::uint8_t>(i), 90,
                                                      static_cast<std::uint8_t>(255 - i)};
    add_lights(rich);
    models.push_back({"radii of two sizes", sphere_model(kBallDepth, {.colour = ColourFormat::rgb888})});
    models.push_back({"field", smooth_ball(kBallDepth, {.colour = ColourFormat::rgb888})});
    Model &measured = models.back().model;
    add_fields(measured);
    colour_by_field(measured, field_colours(1, measured.parameters.fields[1], {}, measured.levels.back().fields[1]));
    models.push_back({"ground, panorama and a mirror", ball_on_ground({.colour = ColourFormat::rgb888})});
    models.back().model.parameters.materials[0].environment = 0.4F;
    models.back().model.parameters.materials[0].tint = 160;
    for (NamedModel &named : models)
        named.model = without_dense_radius(std::move(named.model));
    return models;
}
const std::vector<NamedModel> &ball_models() {
    static const std::vector<NamedModel> kModels = make_ball_models();
    return kModels;
}

struct TableView {
    Camera camera{};
    RenderOptions options{};
    int level = kMaxDepth;
    bool placed = false; // splats lie at surface offsets
    glm::ivec2 size{160, 120};
};

template <class Renderer, class Own>
RenderStatistics draw_view(const Model &model, const TableView &view, Framebuffer &target, const Own &own) {
    Renderer renderer(model, surroundings_of(model));
    if (view.placed && std::min(view.level, model.parameters.grid.depth) > 0) {
        const int level = std::min(view.level, model.parameters.grid.depth);
        std::vector<std::int8_t> offsets(model.levels[static_cast<std::size_t>(level)].points.size());
        Random random(3); // any offsets do
        for (std::int8_t &offset : offsets)
            offset = static_cast<std::int8_t>(static_cast<int>(random.below(64)) - 48);
        renderer.set_offsets(level, offsets);
    }
    return renderer.render(view.camera, view.options, target, own);
}

// Numbers of pixels. `shared`: TableRenderer gives them the colour of their neighbour, since it shades a point once in
// a row of pixels. That is another colour where the point is so edge-on that pixels see different sides of it.
struct Differences {
    std::size_t depths = 0, colours = 0, shared = 0, shown = 0;
};

// Draws with both renderers.
Differences compare_renderers(const Model &model, const TableView &view) {
    Framebuffer plain(view.size.x, view.size.y), tables(view.size.x, view.size.y);
    const RenderStatistics a = draw_view<ReferenceRenderer>(model, view, plain, view.level),
                           b = draw_view<TableRenderer>(model, view, tables, TableOptions{.level = view.level});
    EXPECT_EQ(a.level, b.level);
    EXPECT_EQ(a.points, b.points);
    EXPECT_EQ(a.drawn_points, b.drawn_points);
    Differences differences;
    for (std::size_t i = 0; i < plain.pixels(); ++i) {
        differences.depths +=
            std::bit_cast<std::uint32_t>(plain.depth[i]) != std::bit_cast<std::uint32_t>(tables.depth[i]);
        if (plain.colour[i] != tables.colour[i])
            ++(i > 0 && tables.colour[i] == tables.colour[i - 1] ? differences.shared : differences.colours);
        differences.shown += plain.depth[i] < kEmpty;
    }
    return differences;
}

// `ties`: part of the pixels in which points of two octants may have the same depth, so that either may show.
void expect_same_view(const Model &model, const TableView &view, double ties = 0) {
    const Differences differences = compare_renderers(model, view);
    EXPECT_EQ(differences.depths, 0U);
    EXPECT_LE(static_cast<double>(differences.colours), ties * static_cast<double>(differences.shown));
    EXPECT_LE(differences.shared, differences.shown / 500);
    EXPECT_GT(differences.shown, 80U);
}

// Looks at the ball from outside in a direction that is no axis, so that no two points have the same depth.
Camera beside_ball(double distance = 4) {
    return look_from(glm::dvec3(0, -1, -2) + distance * glm::normalize(glm::dvec3(0.31, 0.53, 0.79)), {0.03, -1.02, -2},
                     0.6);
}

TEST(TableRenderer, DrawsEveryKindOfModelAsTheReferenceDoes) {
    for (const auto &[name, model] : ball_models())
        for (const bool placed : {false, true})
            for (const double distance : {12.0, 4.0, 1.6}) { // voxels from less than a pixel to a dozen
                SCOPED_TRACE(name + (placed ? ", placed, " : ", ") + std::to_string(distance));
                expect_same_view(model, {.camera = beside_ball(distance), .placed = placed});
            }
}

TEST(TableRenderer, DrawsEveryLevelAsTheReferenceDoes) {
    for (const bool placed : {false, true})
        for (int level = 0; level <= kBallDepth + 1; ++level) {
            SCOPED_TRACE(level);
            expect_same_view(ball_models()[1].model, {.camera = beside_ball(), .level = level, .placed = placed});
        }
}

TEST(TableRenderer, DrawsWithEveryOptionAsTheReferenceDoes) {
    for (const auto &[name, model] : ball_models())
        for (bool RenderOptions::*option :
             {&RenderOptions::texture, &RenderOptions::point_colours, &RenderOptions::shadows, &RenderOptions::panorama,
              &RenderOptions::ground, &RenderOptions::reflections}) {
            SCOPED_TRACE(name);
            TableView view{.camera = beside_ball(), .options = {.background = {10, 200, 30, 128}}};
            view.options.*option = false;
            expect_same_view(model, view);
        }
}

// The eye is so far away that depths are coarse.
TEST(TableRenderer, DrawsFromEverySideAndAsEveryCameraAsTheReferenceDoes) {
    const glm::dvec3 middle(0, -1, -2);
    for (const glm::dvec3 side : {glm::dvec3(0.3, 0.2, -0.9), glm::dvec3(-0.7, -0.6, 0.4), glm::dvec3(0.9, -0.35, 0.1)})
        for (const double angle : {0.02, 0.6, 2.4})
            for (const bool orthographic : {false, true})
                for (const bool placed : {false, true}) {
                    SCOPED_TRACE(std::to_string(angle) + (orthographic ? " orthographic" : ""));
                    Camera camera = look_from(middle + side * (1.2 / std::tan(angle / 2) + 1), middle, angle);
                    camera.orthographic = orthographic;
                    expect_same_view(ball_models()[1].model, {.camera = camera, .placed = placed, .size = {131, 97}},
                                     0.005);
                }
}

TEST(TableRenderer, DrawsBacksAndTwoSidedPointsAsTheReferenceDoes) {
    Model two_sided = without_dense_radius(smooth_ball(kBallDepth, {.colour = ColourFormat::rgb888}, 5));
    for (const Backs backs : {Backs::automatic, Backs::show, Backs::hide})
        for (const bool closed : {false, true})
            for (const bool placed : {false, true}) {
                two_sided.parameters.closed = closed;
                TableView view{.camera = beside_ball(), .placed = placed};
                view.camera.backs = backs;
                expect_same_view(two_sided, view);
            }
}

// The eye in the middle of a ball, at its surface and within it: some points reach behind the eye.
TEST(TableRenderer, DrawsPointsAroundTheEyeAsTheReferenceDoes) {
    const glm::dvec3 middle(0, -1, -2), side = glm::normalize(glm::dvec3(0.31, 0.53, 0.79));
    for (const double from : {0.0, 0.5, 0.88, 0.9, 0.91, 0.93})
        for (const bool placed : {false, true}) {
            SCOPED_TRACE(from);
            TableView view{.camera = look_from(middle + from * side, middle + 0.1 * side, 1.3), .placed = placed};
            view.camera.backs = Backs::show;
            if (from == 0)
                view.camera.focal_point = middle + glm::dvec3(0.4, 0.1, -0.2);
            expect_same_view(ball_models()[1].model, view);
        }
}

TEST(TableRenderer, CutsAsTheReferenceDoes) {
    for (const auto &[name, model] : ball_models())
        for (const bool placed : {false, true})
            for (int cut = 0; cut < 3; ++cut) {
                SCOPED_TRACE(name);
                TableView view{.camera = beside_ball(), .placed = placed};
                if (cut != 1)
                    view.camera.clip.plane = ClipPlane{{0.1013, -1.0517, -2.0033}, {-0.41, -0.287, -0.513}};
                if (cut != 0)
                    view.camera.clip.box = ClipBox{{-0.61, -1.57, -2.93}, {0.77, -0.45, -1.33}};
                expect_same_view(model, view);
            }
}

// Shapes of splats of dense parts are those of the middle of their octant. The smaller the angle of an octant, the less
// that shows.
TEST(TableRenderer, SharesShapesInAnOctant) {
    Model dense = smooth_ball(kBallDepth, {.colour = ColourFormat::rgb888});
    for (std::uint8_t &radius : dense.levels.back().points.radii)
        radius = radius_index(std::ldexp(0.87, -kBallDepth));
    const auto share = [&](const Camera &camera) {
        const Differences differences = compare_renderers(dense, {.camera = camera});
        return static_cast<double>(differences.colours + differences.shared) / static_cast<double>(differences.shown);
    };
    Camera telecentric_eye = beside_ball();
    telecentric_eye.orthographic = true;
    EXPECT_LT(share(telecentric_eye), 0.002);
    const double whole = share(beside_ball());
    EXPECT_GT(whole, 0.001);
    EXPECT_LT(whole, 0.1);
    EXPECT_EQ(share(beside_ball(1.6)), 0); // octants that cover a wide angle have no table
}

// The depths of a picture of kernels, drawn point by point.
std::vector<float> depths_of_kernels(const Model &model, const Camera &camera, glm::ivec2 size) {
    const Projection projection(in_unit_grid(camera, model.parameters), size.x, size.y);
    const double middle = projection.point(glm::dvec3(0.5)).z, half = std::sqrt(0.75);
    const SplatKernels kernels(projection, size.x, size.y, middle - half, middle + half);
    std::vector<MortonCode> codes{0};
    for (int level = 1; level <= kBallDepth; ++level)
        codes = expand_level(codes, model.levels[static_cast<std::size_t>(level)].masks, 1 << 20).value();
    const PointAttributes &points = model.levels.back().points;
    Framebuffer target(size.x, size.y);
    for (std::size_t i = 0; i < codes.size(); ++i) {
        glm::vec3 image(projection.point(glm::dvec3(0.5)));
        for (int level = 1; level <= kBallDepth; ++level) {
            const auto child = codes[i] >> 3 * (kBallDepth - level);
            const double d = std::ldexp(0.5, -level);
            image += glm::vec3(projection.vector({child & 1 ? d : -d, child & 2 ? d : -d, child & 4 ? d : -d}));
        }
        const glm::vec2 pixel(image.x / image.z, image.y / image.z);
        const UnitVector &n = normal_table()[points.normals[i]];
        const auto plane = glm::vec3(projection.plane({n[0], n[1], n[2]}));
        if (glm::dot(plane, glm::vec3(pixel, 1)) > kFacingSlack)
            continue;
        const float radius = 2 * radius_table()[points.radii[i]] * static_cast<float>(projection.focal) / image.z;
        kernels.draw(points.normals[i], pixel, image.z, radius, static_cast<std::uint32_t>(i), target);
    }
    std::vector<float> depths(target.depth.begin(), target.depth.end());
    for (float &depth : depths)
        depth *= static_cast<float>(model.parameters.grid.edge());
    return depths;
}

TEST(TableRenderer, DrawsKernelsAsALoopOverPointsDoes) {
    for (const double distance : {10.9, 3.7, 2.2}) { // radii on both sides of 1, 3 and 8 pixels
        TableView view{.camera = beside_ball(distance)};
        view.options.ground = false;
        Framebuffer target(view.size.x, view.size.y);
        draw_view<TableRenderer>(ball_models()[0].model, view, target, TableOptions{.splats = Splats::kernels});
        const auto expected = depths_of_kernels(ball_models()[0].model, view.camera, view.size);
        const std::vector<float> drawn(target.depth.begin(), target.depth.end());
        EXPECT_EQ(drawn, expected) << distance;
        EXPECT_GT(std::count_if(drawn.begin(), drawn.end(), [](float depth) { return depth < kEmpty; }), 100);
    }
}

TEST(TableRenderer, FillsWallsWithKernels) {
    const Model model = make_wall(6, 20);
    for (const double distance : {15.0, 30.0, 60.0, 110.0}) {
        Framebuffer target(50, 50);
        TableRenderer(model).render(camera_in_front({32, 32, 20.5}, distance), {}, target, {.splats = Splats::kernels});
        for (std::size_t i = 0; i < target.pixels(); ++i)
            EXPECT_NEAR(target.depth[i], distance, 0.01) << distance;
    }
}

TEST(TransformTable, LeadsFromTheCubeToEveryVoxelByAdditions) {
    Grid grid;
    grid.depth = 5;
    grid.origin = {-3, 7, 11};
    grid.voxel_size = 0.25;
    const Projection projection(camera_in_front({1, 11, 15}, 20), 640, 480);
    const TransformTable table(grid, projection);
    const std::array<std::uint32_t, 3> place{19, 4, 30};
    glm::vec4 p = table.centre;
    for (std::size_t level = 1; level <= 5; ++level) {
        std::size_t child = 0;
        for (std::size_t axis = 0; axis < 3; ++axis)
            child |= (place[axis] >> (5 - level) & 1) << axis;
        p += table.child[level][child];
    }
    const glm::dvec3 exact = projection.point({-3 + 0.25 * 19.5, 7 + 0.25 * 4.5, 11 + 0.25 * 30.5});
    EXPECT_NEAR(p.x / p.z, exact.x / exact.z, 1e-3);
    EXPECT_NEAR(p.y / p.z, exact.y / exact.z, 1e-3);
    EXPECT_NEAR(p.z, exact.z, 1e-5);
}

TEST(FacingFlags, NeverHideAPointThatMayBeSeen) {
    const glm::dvec3 eye(5, 3, 9), centre(1, 2, 3);
    const double half = 1.5;
    std::vector<Facing> facing;
    mark_facing(eye, centre, half, facing);
    ASSERT_EQ(facing.size(), 2U * kNormalCount);
    int away = 0, front = 0;
    for (std::size_t i = 0; i < kNormalCount; ++i) {
        const UnitVector &n = normal_table()[i];
        bool shows = false, hides = false;
        for (int corner = 0; corner < 8; ++corner) {
            const glm::dvec3 p =
                centre + half * glm::dvec3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
            const glm::dvec3 ray = p - eye;
            const double side = n[0] * ray.x + n[1] * ray.y + n[2] * ray.z;
            shows |= side < 0;
            hides |= side > 0;
        }
        EXPECT_FALSE(shows && facing[i] == Facing::away);
        EXPECT_FALSE(hides && facing[i] == Facing::front);
        away += facing[i] == Facing::away;
        front += facing[i] == Facing::front;
        EXPECT_EQ(facing[i | kTwoSidedBit], Facing::both);
    }
    EXPECT_GT(away, kNormalCount / 5);
    EXPECT_GT(front, kNormalCount / 5);
}

TEST(FacingFlags, OppositeNormalsAreOneFlipApart) {
    for (std::size_t i = 0; i < kNormalCount; ++i)
        for (std::size_t axis = 0; axis < 3; ++axis)
            EXPECT_DOUBLE_EQ(normal_table()[i][axis], -normal_table()[i ^ kOppositeNormal][axis]);
}

} // namespace
} // namespace pbm
