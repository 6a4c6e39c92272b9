// Holes, bleed and depth of closed meshes. The limits are those of docs/explanation/fidelity.md or stricter.
#include "error_places.h"
#include "fidelity.h"
#include "pbm_format/writing/writer.h"
#include "procedural_mesh.h"
#include "voxel_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <vector>

namespace pbm {
namespace {

struct Shape {
    const char *name;
    TriangleMesh (*make)();
};

// A mesh for ray casting, and a file made from it for the fast renderer.
struct Subject {
    explicit Subject(const Shape &shape)
        : mesh(shape.make()), rays(mesh, glm::dvec3(0)), model(voxelise_by_brute_force(mesh, 10, 1.6)),
          bounds(find_extent(model).sphere), file(encode_model(model, {.compression_level = 1, .threads = 2}).value()),
          streamed(Reader::open(file).value()),
          renderer(streamed.reader().parameters(), streamed.reader().header().chunk_points, 2) {}

    std::array<Camera, 8> cameras(int width, int height) const {
        return eight_views(bounds, model.parameters.grid.up, width, height);
    }

    std::vector<View> measure(const Draw &draw, int width, int height) {
        const std::array<Camera, 8> views = cameras(width, height);
        std::vector<PictureTruth> &known = truths[height];
        for (std::size_t i = known.size(); i < views.size(); ++i)
            known.emplace_back(rays.cast(views[i], width, height, 2), width);
        return measure_fidelity(known, draw, views, width, height);
    }

    TriangleMesh mesh;
    RayCaster rays;
    std::map<int, std::vector<PictureTruth>> truths; // by height: casting rays takes most of the time
    Model model;
    Sphere bounds;
    Bytes file;
    StreamedModel streamed;
    FastRenderer renderer;
};

class ClosedMesh : public testing::TestWithParam<Shape> {
  protected:
    // Keeps the last subject, so that the tests of one shape share it.
    static Subject &subject() {
        static std::string name;
        static std::unique_ptr<Subject> last;
        if (name != GetParam().name) {
            last = std::make_unique<Subject>(GetParam());
            name = GetParam().name;
        }
        return *last;
    }
};

void expect_no_holes(const std::vector<View> &views, const std::string &what) {
    for (std::size_t i = 0; i < views.size(); ++i) {
        EXPECT_GT(views[i].figures.interior, 1000U);
        EXPECT_EQ(views[i].figures.holes, 0U) << what << ", view " << i;
        EXPECT_EQ(views[i].figures.see_through, 0U) << what << ", view " << i;
    }
    if (testing::Test::HasFailure() || testing::GTEST_FLAG(print_time))
        std::printf("%s\n%s", what.c_str(), to_text(views).c_str());
}

TEST_P(ClosedMesh, HasNoHolesInTheReferenceFromEightViewsAtDepths8To10) {
    Subject &it = subject();
    const ReferenceRenderer reference(it.model);
    const TableRenderer tables(it.model);
    // About one and two pixels per voxel. In closer views the edges end up to 0.6 voxels early, because points on sharp
    // edges may have a mean normal that faces away.
    struct Picture {
        int level, width, height;
    };
    for (const auto &[level, width, height] : {Picture{8, 640, 360}, Picture{9, 1280, 720}, Picture{10, 1280, 720}}) {
        expect_no_holes(it.measure(draw_level(reference, it.model.parameters.grid, level), width, height),
                        "reference, level " + std::to_string(level));
        expect_no_holes(it.measure(draw_level(tables, it.model.parameters.grid, level), width, height),
                        "tables, level " + std::to_string(level));
    }
}

// The picture sizes give voxels from half of max_error up to max_error.
TEST_P(ClosedMesh, KeepsTheGatesWithLevelsMixed) {
    Subject &it = subject();
    struct Sizes {
        double max_error;
        std::vector<int> heights;
    };
    for (const auto &[max_error, heights] :
         {Sizes{kFastMaxError, {300, 360, 430, 520, 610, 720}}, Sizes{1, {360, 610}}, Sizes{1.42, {300, 430, 610}}})
        for (const int height : heights) {
            const int width = height * 16 / 9;
            const std::vector<View> views =
                it.measure(draw_detail(it.streamed, it.renderer, max_error, kMaxDepth), width, height);
            const std::string what = "max error " + std::to_string(max_error) + ", " + std::to_string(height) + " rows";
            expect_no_holes(views, what);
            const FidelityFigures all = total(views);
            EXPECT_EQ(all.shrunk, 0U) << what;
            EXPECT_LE(percent(all.bleed, all.object), 0.1) << what;
            EXPECT_GE(percent(all.deep_near, all.interior), 99.5) << what;
        }
}

// Voxels of the finest level are 2 and 4 pixels wide, so nearly every splat is an ellipse. Points on sharp edges whose
// mean normal faces away are not drawn, so the edges of the cube and the rim of the bowl end early. Surface offsets are
// means over neighbours, which also lowers the rim slightly.
TEST_P(ClosedMesh, HasNoHolesCloserThanTheFinestLevelAllows) {
    Subject &it = subject();
    for (const int finest : {9, 8}) {
        const std::vector<View> views =
            it.measure(draw_detail(it.streamed, it.renderer, kFastMaxError, finest), 1280, 720);
        const FidelityFigures all = total(views);
        const std::string what = "finest level " + std::to_string(finest) + "\n" + to_text(views);
        EXPECT_EQ(all.holes, 0U) << what;
        EXPECT_LE(percent(all.see_through, all.interior), finest == 9 ? 0 : 0.02) << what;
        EXPECT_GE(percent(all.deep_near, all.interior), finest == 9 ? 99 : 98) << what;
    }
}

TEST(SharpEdges, AreThoseOfACubeAndOfAHoleInIt) {
    TriangleMesh cube = make_cube();
    EXPECT_EQ(sharp_edges(cube).size(), 12U);
    cube.triangles.pop_back(); // half of a side: its diagonal becomes a border
    EXPECT_EQ(sharp_edges(cube).size(), 13U);
}

// A picture of nothing differs from the truth along the whole cube; each pixel counts once.
TEST(ErrorPlaces, HoldEveryPixelOnce) {
    const TriangleMesh mesh = make_cube();
    const RayCaster rays(mesh, glm::dvec3(0));
    const Camera camera = eight_views({glm::dvec3(0), 0.6}, UpAxis::y, 160, 90)[5];
    const PictureTruth truth(rays.cast(camera, 160, 90, 1), 160);
    std::vector<Srgb> colours;
    std::uint64_t hits = 0;
    for (const float depth : truth.rays.depths) {
        const bool is_hit = depth < std::numeric_limits<float>::infinity();
        colours.push_back(is_hit ? Srgb{255, 255, 255} : Srgb{51, 51, 51});
        hits += is_hit;
    }
    Framebuffer nothing(160, 90);
    std::fill(nothing.colour.begin(), nothing.colour.end(), pack_rgba({51, 51, 51, 255}));
    ErrorPlaces places;
    add_error_places(sharp_edges(mesh), camera, truth, colours, nothing, places);
    EXPECT_EQ(std::accumulate(places.pixels.begin(), places.pixels.end(), std::uint64_t{0}), hits);
    EXPECT_EQ(places.pixels[ErrorPlaces::outline], 0U); // it ends at its edges everywhere
    EXPECT_GT(places.pixels[ErrorPlaces::outline_at_edge], 0U);
    EXPECT_GT(places.pixels[ErrorPlaces::edge], 0U);
    EXPECT_GT(places.pixels[ErrorPlaces::elsewhere], places.pixels[ErrorPlaces::edge]);
    EXPECT_EQ(places.pixels[ErrorPlaces::contour] + places.pixels[ErrorPlaces::contour_at_edge], 0U);
}

INSTANTIATE_TEST_SUITE_P(Fidelity, ClosedMesh,
                         testing::Values(Shape{"Sphere", make_sphere}, Shape{"Torus", make_torus},
                                         Shape{"Cube", make_cube}, Shape{"Bowl", make_bowl}, Shape{"Knot", make_knot}),
                         [](const auto &test) { return std::string(test.param.name); });

} // namespace
} // namespace pbm
