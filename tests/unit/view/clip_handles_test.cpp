#include "viewer/pbm-view/clipping/clip_handles.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

namespace pbm {
namespace {

constexpr glm::ivec2 kPicture{800, 600};
const Sphere kAround{{10, 20, 30}, 2};

// Looks at the middle of the bounds from the right, from above and from the front.
Camera camera() {
    Camera camera;
    camera.focal_point = kAround.centre;
    camera.position = kAround.centre + glm::dvec3(3, 4, 9);
    return camera;
}

PictureSpace space() { return {camera(), 4, kPicture}; }

glm::dvec3 place_of(const ClipRegion &region, ClipHandle handle) {
    for (const HandlePlace &at : clip_handles(region, kAround.radius))
        if (at.handle == handle)
            return at.place;
    ADD_FAILURE() << "no such handle";
    return {};
}

ClipRegion plane() { return {.plane = first_clip_plane(camera(), kAround), .box = {}}; }
ClipRegion box() { return {.plane = {}, .box = first_clip_box(kAround)}; }

TEST(ClipHandles, TheFirstPlaneCutsAwayTheHalfNearerToTheEye) {
    EXPECT_EQ(plane().plane->point, kAround.centre);
    EXPECT_EQ(plane().plane->normal, glm::dvec3(0, 0, -1));
    EXPECT_EQ(box().box->least, glm::dvec3(8, 18, 28));
    EXPECT_EQ(box().box->most, glm::dvec3(12, 22, 32));
}

// A handle that is dragged to the image of a place that it can reach moves to this place.
TEST(ClipHandles, FollowTheMouse) {
    ClipRegion moved = plane();
    const glm::dvec3 wanted = kAround.centre + glm::dvec3(0, 0, 0.7);
    moved = after_handle_drag(moved, ClipHandle::plane, 2, space(), space().place(wanted).pixel);
    EXPECT_NEAR(glm::distance(moved.plane->point, wanted), 0, 1e-9);
    EXPECT_EQ(moved.plane->normal, plane().plane->normal);

    const glm::dvec3 direction = glm::normalize(glm::dvec3(0.3, -0.4, -0.8));
    ClipRegion turned =
        after_handle_drag(plane(), ClipHandle::normal, 2, space(), space().place(kAround.centre + direction).pixel);
    EXPECT_NEAR(glm::distance(turned.plane->normal, direction), 0, 1e-9);
    EXPECT_EQ(turned.plane->point, kAround.centre);

    for (int face = 0; face < 6; ++face) {
        const auto handle = static_cast<ClipHandle>(static_cast<int>(ClipHandle::least_x) + face);
        glm::dvec3 to = place_of(box(), handle);
        to[face / 2] = kAround.centre[face / 2] + (face % 2 == 0 ? -0.3 : 0.4);
        const ClipRegion dragged = after_handle_drag(box(), handle, 2, space(), space().place(to).pixel);
        EXPECT_NEAR(glm::distance(place_of(dragged, handle), to), 0, 1e-9) << face;
    }
}

TEST(ClipHandles, ABoxKeepsItsInside) {
    const glm::dvec3 beyond = kAround.centre + glm::dvec3(5, 0, 0);
    const ClipRegion dragged = after_handle_drag(box(), ClipHandle::least_x, 2, space(), space().place(beyond).pixel);
    EXPECT_NEAR(dragged.box->most.x - dragged.box->least.x, 2e-3, 1e-9);
}

TEST(ClipHandles, AlongTheLineOfSightNothingMoves) {
    Camera along = camera();
    along.position = kAround.centre + glm::dvec3(0, 0, 9);
    const PictureSpace seen(along, 4, kPicture);
    EXPECT_EQ(after_handle_drag(plane(), ClipHandle::plane, 2, seen, glm::dvec2(kPicture) / 2.0), plane());
}

TEST(ClipHandles, TheNearestWithinReachIsTaken) {
    const std::vector<HandlePlace> handles = clip_handles(box(), 2);
    const glm::dvec2 top = space().place(place_of(box(), ClipHandle::most_y)).pixel;
    EXPECT_EQ(handle_at(handles, space(), top + glm::dvec2(5, 3), 8), ClipHandle::most_y);
    EXPECT_EQ(handle_at(handles, space(), {1, 1}, 8), std::nullopt);
    EXPECT_TRUE(clip_handles({}, 2).empty());
}

TEST(ClipHandles, OutlinesAreACircleWithANormalAndTwelveEdges) {
    EXPECT_EQ(clip_outline(plane(), 2).size(), 49U);
    EXPECT_EQ(clip_outline(box(), 2).size(), 12U);
    for (const auto &[from, to] : clip_outline(box(), 2))
        EXPECT_NEAR(glm::distance(from, to), 4, 1e-12);
    EXPECT_TRUE(clip_outline({}, 2).empty());
}

} // namespace
} // namespace pbm
