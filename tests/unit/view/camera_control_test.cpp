#include "viewer/scene/camera_control.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <gtest/gtest.h>

#include <cmath>

namespace pbm {
namespace {

// Looks along -Z from a distance of 10; the focal point is not the origin.
Camera test_camera() {
    Camera camera;
    camera.focal_point = {1, 2, 3};
    camera.position = {1, 2, 13};
    return camera;
}

double distance(const Camera &camera) { return glm::length(camera.position - camera.focal_point); }

void expect_near(const glm::dvec3 &a, const glm::dvec3 &b) { EXPECT_NEAR(glm::length(a - b), 0, 1e-9); }

TEST(Orbit, AQuarterToTheRightStandsOnTheRight) {
    const Camera camera = orbit(test_camera(), glm::radians(90.0), 0);
    expect_near(camera.position, {11, 2, 3});
    expect_near(camera.focal_point, {1, 2, 3});
    expect_near(camera.up, {0, 1, 0});
}

TEST(Orbit, UpwardsTheEyeRises) {
    const Camera camera = orbit(test_camera(), 0, glm::radians(30.0));
    expect_near(camera.position, {1, 2 + 5, 3 + 10 * std::cos(glm::radians(30.0))});
}

TEST(Orbit, NeverReachesThePoles) {
    for (const double up : {100.0, -100.0, 1e6}) {
        const Camera camera = orbit(test_camera(), 0.3, up);
        EXPECT_TRUE(is_usable(camera));
        EXPECT_NEAR(distance(camera), 10, 1e-9);
        const double height = (camera.position.y - 2) / 10;
        EXPECT_NEAR(std::abs(height), std::cos(glm::radians(1.0)), 1e-9);
        EXPECT_EQ(height > 0, up > 0);
    }
}

TEST(Orbit, KeepsAnUpAxisThatIsNotOfLengthOne) {
    Camera camera = test_camera();
    camera.up = {0, 0.5, 0.001};
    const Camera turned = orbit(camera, 1, 0.2);
    expect_near(turned.up, camera.up);
    EXPECT_NEAR(distance(turned), 10, 1e-9);
}

TEST(Orbit, AThousandTurnsKeepTheDistance) {
    Camera camera = test_camera();
    for (int i = 0; i < 1000; ++i)
        camera = orbit(camera, 0.37, i % 2 == 0 ? 0.2 : -0.2);
    EXPECT_NEAR(distance(camera), 10, 1e-9);
}

TEST(Approach, ScalesTheDistanceWithinLimits) {
    EXPECT_NEAR(distance(approach(test_camera(), 0.5, 4)), 5, 1e-12);
    EXPECT_NEAR(distance(approach(test_camera(), 0, 4)), 4e-3, 1e-12);
    EXPECT_NEAR(distance(approach(test_camera(), 1e30, 4)), 4e3, 1e-9);
    // A camera beyond the limits may move back, but no further away.
    EXPECT_NEAR(distance(approach(test_camera(), 2, 1e-6)), 10, 1e-12);
    EXPECT_NEAR(distance(approach(test_camera(), 0.5, 1e-6)), 5, 1e-12);
}

TEST(Pan, MovesTheFocalPlaneByTheOffset) {
    const Camera camera = pan(test_camera(), {0.25, 0.5});
    const double height = 2 * 10 * std::tan(kDefaultViewAngle / 2);
    expect_near(camera.focal_point, {1 - 0.25 * height, 2 - 0.5 * height, 3});
    expect_near(camera.position - camera.focal_point, {0, 0, 10});
}

TEST(Turn, LooksToTheRightAndUpFromTheSamePlace) {
    const Camera right = turn(test_camera(), glm::radians(90.0), 0);
    expect_near(right.position, {1, 2, 13});
    expect_near(right.focal_point, {11, 2, 13});
    const Camera up = turn(test_camera(), 0, glm::radians(30.0));
    expect_near(up.focal_point, {1, 2 + 5, 13 - 10 * std::cos(glm::radians(30.0))});
    EXPECT_TRUE(is_usable(turn(test_camera(), 0, 50)));
}

TEST(Advance, FliesAlongTheViewDirectionAndSideways) {
    const Camera camera = advance(test_camera(), 2, 3);
    expect_near(camera.position, {3, 2, 10});
    expect_near(camera.focal_point, {3, 2, 0});
}

TEST(CameraInput, MeansTheSameAsInOtherViewers) {
    const Camera camera = test_camera();
    const auto orbiting = CameraMode::orbit;
    // The model follows the mouse: dragged right, its left side comes to the front.
    EXPECT_LT(after_drag(camera, orbiting, Drag::turn, {0.1, 0}, 1).position.x, camera.position.x);
    EXPECT_LT(after_drag(camera, orbiting, Drag::turn, {0, 0.1}, 1).position.y, camera.position.y);
    EXPECT_LT(after_drag(camera, orbiting, Drag::pan, {0.1, 0}, 1).position.x, camera.position.x);
    EXPECT_LT(distance(after_drag(camera, orbiting, Drag::distance, {0, 0.1}, 1)), 10);
    EXPECT_NEAR(distance(after_wheel(camera, orbiting, 1, 1)), 9, 1e-12);
    EXPECT_NEAR(distance(after_wheel(after_wheel(camera, orbiting, 2.5, 1), orbiting, -2.5, 1)), 10, 1e-12);
    EXPECT_LT(distance(after_arrows(camera, orbiting, {0, 1}, 1)), 10);
    EXPECT_GT(distance(after_arrows(camera, orbiting, {0, -1}, 1)), 10);
    EXPECT_GT(after_arrows(camera, orbiting, {1, 0}, 1).position.x, camera.position.x);
}

TEST(CameraInput, FliesThroughTheModel) {
    const Camera camera = test_camera();
    const auto flying = CameraMode::fly;
    expect_near(after_drag(camera, flying, Drag::turn, {0.1, 0.2}, 1).position, camera.position);
    EXPECT_GT(after_drag(camera, flying, Drag::turn, {0.1, 0}, 1).focal_point.x, camera.focal_point.x);
    EXPECT_GT(after_drag(camera, flying, Drag::turn, {0, 0.1}, 1).focal_point.y, camera.focal_point.y);
    const Camera forward = after_arrows(camera, flying, {0, 4}, 10);
    expect_near(forward.position, {1, 2, 13 - 4 * 0.05 * 10});
    expect_near(forward.focal_point - forward.position, {0, 0, -10});
    EXPECT_GT(after_arrows(camera, flying, {1, 0}, 10).position.x, camera.position.x);
    EXPECT_LT(after_wheel(camera, flying, 1, 10).position.z, camera.position.z);
}

TEST(HeldArrows, AShortPressIsOneStep) {
    HeldArrows arrows;
    EXPECT_FALSE(arrows.next_step(5));
    arrows.press(Arrow::up, 5);
    EXPECT_TRUE(arrows.next_step(5));
    EXPECT_EQ(arrows.take_steps(5.01), glm::dvec2(0, 1));
    EXPECT_EQ(arrows.take_steps(5.1), glm::dvec2(0, 0));
    arrows.release(Arrow::up, 5.2);
    EXPECT_EQ(arrows.take_steps(9), glm::dvec2(0, 0));
    EXPECT_FALSE(arrows.next_step(9));
}

TEST(HeldArrows, ALongPressMovesSteadilyHoweverOftenItIsAsked) {
    const auto steps_after = [](double seconds, double interval) {
        HeldArrows arrows;
        arrows.press(Arrow::left, 1);
        glm::dvec2 steps(0);
        for (double now = 1; now < 1 + seconds; now += interval)
            steps += arrows.take_steps(now);
        arrows.release(Arrow::left, 1 + seconds);
        return (steps + arrows.take_steps(1 + seconds)).x;
    };
    EXPECT_NEAR(steps_after(1.25, 0.01), -21, 1e-9); // one step, then 20 per second after 0.25 seconds
    EXPECT_NEAR(steps_after(1.25, 0.3), -21, 1e-9);
    EXPECT_NEAR(steps_after(1.25, 2), -21, 1e-9);
}

TEST(HeldArrows, OppositeKeysCancelAndTwoKeysAdd) {
    HeldArrows arrows;
    arrows.press(Arrow::up, 0);
    arrows.press(Arrow::right, 0);
    arrows.press(Arrow::up, 0); // key repeat
    EXPECT_EQ(arrows.take_steps(0.1), glm::dvec2(1, 1));
    arrows.press(Arrow::down, 0.1);
    arrows.release(Arrow::right, 0.1);
    EXPECT_EQ(arrows.take_steps(0.1), glm::dvec2(0, -1));
    const glm::dvec2 later = arrows.take_steps(2.35);
    EXPECT_NEAR(later.x, 0, 1e-9);
    EXPECT_NEAR(later.y, 20 * 0.1, 1e-9); // up moved 0.1 seconds longer than down
}

TEST(HeldArrows, SayWhenTheNextStepIsToBeDrawn) {
    HeldArrows arrows;
    arrows.press(Arrow::down, 1);
    EXPECT_GT(*arrows.next_step(1), 1.25);
    EXPECT_LT(*arrows.next_step(1), 1.3);
    EXPECT_GT(*arrows.next_step(7), 7);
    EXPECT_LT(*arrows.next_step(7), 7.05);
}

} // namespace
} // namespace pbm
