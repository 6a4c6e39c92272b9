#include "fidelity.h"
#include "procedural_mesh.h"
#include "voxel_model.h"

#include <gtest/gtest.h>

namespace pbm {
namespace {

struct Shape {
    const char *name;
    TriangleMesh (*make)();
};

class ClosedMesh : public testing::TestWithParam<Shape> {};

TEST_P(ClosedMesh, HasNoHolesFromEightViewsAtDepths8To10) {
    const TriangleMesh mesh = GetParam().make();
    const RayCaster rays(mesh, glm::dvec3(0));
    const Model model = voxelise_by_brute_force(mesh, 10, 1.6);
    // About one and two pixels per voxel. Closer by, points on sharp edges whose mean normal faces away show: the edge
    // ends up to 0.6 voxels early.
    struct Picture {
        int level, width, height;
    };
    for (const auto &[level, width, height] : {Picture{8, 640, 360}, Picture{9, 1280, 720}, Picture{10, 1280, 720}}) {
        const std::vector<View> views = measure_fidelity(rays, model, level, width, height, 2);
        for (std::size_t i = 0; i < views.size(); ++i) {
            EXPECT_GT(views[i].figures.interior, 1000U);
            EXPECT_EQ(views[i].figures.holes, 0U) << "level " << level << ", view " << i;
            EXPECT_EQ(views[i].figures.see_through, 0U) << "level " << level << ", view " << i;
        }
        if (testing::Test::HasFailure() || testing::GTEST_FLAG(print_time))
            std::printf("level %d, %.2f pixels per voxel\n%s", level, views[0].voxel_pixels, to_text(views).c_str());
    }
}

INSTANTIATE_TEST_SUITE_P(Fidelity, ClosedMesh,
                         testing::Values(Shape{"Sphere", make_sphere}, Shape{"Torus", make_torus},
                                         Shape{"Cube", make_cube}, Shape{"Bowl", make_bowl}, Shape{"Knot", make_knot}),
                         [](const auto &test) { return std::string(test.param.name); });

} // namespace
} // namespace pbm
