#include "viewer/navigation/camera_glide.h"
#include "viewer/navigation/standard_views.h"

#include "pbm_render/camera/projection.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <cmath>

namespace pbm {
namespace {

const Sphere kBounds{{1, 2, 3}, 4};
constexpr glm::ivec2 kFramed{300, 200};

Camera view_of(StandardView view, UpAxis up = UpAxis::z, bool orthographic = false) {
    Camera camera;
    camera.orthographic = orthographic;
    return standard_view(view, up, camera, kBounds, kFramed);
}

double focal_distance(const Camera &camera) { return glm::length(camera.position - camera.focal_point); }

TEST(CameraGlide, BeginsAtOneViewAndEndsExactlyAtTheOther) {
    const Camera from = view_of(StandardView::front), to = view_of(StandardView::isometric);
    const CameraGlide glide(from, to, 7);
    EXPECT_NEAR(glm::length(glide.at(7).position - from.position), 0, 1e-9);
    EXPECT_NEAR(glm::length(eye_axes(glide.at(7)).up - eye_axes(from).up), 0, 1e-9);
    EXPECT_FALSE(glide.is_done(7 + 0.99 * CameraGlide::kDuration));
    for (const double later : {1.0, 1.5, 100.0}) {
        EXPECT_TRUE(glide.is_done(7 + later * CameraGlide::kDuration));
        EXPECT_EQ(glide.at(7 + later * CameraGlide::kDuration), to);
    }
    EXPECT_NEAR(glm::length(glide.at(7 + 0.99999 * CameraGlide::kDuration).position - to.position), 0, 1e-6);
}

TEST(CameraGlide, IsSmoothAlsoHalfATurnAround) {
    const Camera top = view_of(StandardView::top);
    Camera from = view_of(StandardView::front);
    from.position = 2.0 * from.focal_point - from.position; // from behind, and ten times nearer
    from.position = from.focal_point + 0.1 * (from.position - from.focal_point);
    for (const Camera &to : {view_of(StandardView::front), top, from}) {
        const CameraGlide glide(from, to, 0);
        Camera last = from;
        double longest = 0;
        constexpr int kSteps = 500;
        for (int i = 1; i <= kSteps; ++i) {
            const Camera camera = glide.at(CameraGlide::kDuration * i / kSteps);
            ASSERT_TRUE(is_usable(camera));
            ASSERT_GE(focal_distance(camera), std::min(focal_distance(from), focal_distance(to)) - 1e-9);
            longest = std::max(longest, glm::length(eye_axes(camera).forward - eye_axes(last).forward));
            last = camera;
        }
        EXPECT_LT(longest, 1.5 * std::acos(-1.0) / kSteps * 1.01); // the fastest part of a smooth step
        EXPECT_EQ(last, to);
    }
}

// Every corner of the cube around the sphere's poles lies in the picture, and the sphere touches its border.
TEST(StandardViews, ShowTheWholeModelFromWhereTheySay) {
    for (const UpAxis axis : {UpAxis::x, UpAxis::y, UpAxis::z})
        for (const bool orthographic : {false, true}) {
            const glm::dvec3 up = up_direction(axis), front = front_direction(axis), right = glm::cross(up, front);
            const auto from = [&](StandardView view) {
                const Camera camera = view_of(view, axis, orthographic);
                EXPECT_EQ(camera.focal_point, kBounds.centre);
                EXPECT_EQ(camera.orthographic, orthographic);
                // The highest point of the outline.
                const Projection seen(telecentric(camera, 10), kFramed.x, kFramed.y);
                const glm::dvec3 eye = seen.eye - kBounds.centre;
                const double cosine = kBounds.radius / glm::length(eye);
                const glm::dvec3 high =
                    seen.point(kBounds.centre + kBounds.radius * (cosine * glm::normalize(eye) +
                                                                  std::sqrt(1 - cosine * cosine) * seen.axes.up));
                EXPECT_NEAR(high.y / high.z, 0, 0.5);
                return glm::normalize(camera.position - camera.focal_point);
            };
            EXPECT_NEAR(glm::length(from(StandardView::front) - front), 0, 1e-12);
            EXPECT_NEAR(glm::length(from(StandardView::side) - right), 0, 1e-12);
            EXPECT_NEAR(glm::length(from(StandardView::top) - up), 0, 1e-12);
            EXPECT_NEAR(glm::length(from(StandardView::isometric) - glm::normalize(up + front + right)), 0, 1e-12);
            EXPECT_NEAR(glm::length(eye_axes(view_of(StandardView::top, axis)).right - right), 0, 1e-12);
        }
}

TEST(Fitted, KeepsTheDirection) {
    Camera camera = view_of(StandardView::isometric);
    camera.focal_point += glm::dvec3(100, 3, 4);
    camera.position += glm::dvec3(100, 3, 4);
    const Camera fits = fitted(camera, kBounds, {200, 300}); // upright: the width is what counts
    EXPECT_NEAR(glm::length(eye_axes(fits).forward - eye_axes(camera).forward), 0, 1e-12);
    EXPECT_EQ(fits.focal_point, kBounds.centre);
    EXPECT_NEAR(focal_distance(fits), 4 / std::sin(std::atan(std::tan(camera.view_angle / 2) * 2 / 3)), 1e-9);
}

} // namespace
} // namespace pbm
