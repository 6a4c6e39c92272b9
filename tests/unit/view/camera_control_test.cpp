#include "viewer/navigation/camera_control.h"

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

constexpr glm::dvec3 kUp(0, 1, 0);

// Round the focal point of test_camera().
Steering steering(CameraMode mode, double radius) { return {mode, kUp, {{1, 2, 3}, radius}}; }

void expect_near(const glm::dvec3 &a, const glm::dvec3 &b) { EXPECT_NEAR(glm::length(a - b), 0, 1e-9); }

// Where a point lies in the picture, as the offset from its middle over the distance in front of the eye.
glm::dvec2 seen(const Camera &camera, const glm::dvec3 &point) {
    const EyeAxes axes = eye_axes(camera);
    const glm::dvec3 from_eye = point - camera.position;
    return glm::dvec2(glm::dot(from_eye, axes.right), glm::dot(from_eye, axes.up)) / glm::dot(from_eye, axes.forward);
}

TEST(Orbit, AQuarterToTheRightStandsOnTheRight) {
    const Camera camera = orbit(test_camera(), kUp, glm::radians(90.0), 0);
    expect_near(camera.position, {11, 2, 3});
    expect_near(camera.focal_point, {1, 2, 3});
    expect_near(camera.up, {0, 1, 0});
}

TEST(Orbit, UpwardsTheEyeRises) {
    const Camera camera = orbit(test_camera(), kUp, 0, glm::radians(30.0));
    expect_near(camera.position, {1, 2 + 5, 3 + 10 * std::cos(glm::radians(30.0))});
}

// The picture's up direction is then that in which the eye came.
TEST(Orbit, StopsRightAboveAndBelow) {
    for (const double up : {100.0, -100.0, 1e6}) {
        const Camera camera = orbit(test_camera(), kUp, 0, up);
        EXPECT_TRUE(is_usable(camera));
        expect_near(camera.position - camera.focal_point, {0, up > 0 ? 10 : -10, 0});
        expect_near(camera.up, {0, 0, up > 0 ? -1 : 1});
        // There a turn turns the picture, and the eye comes down on that side.
        const Camera turned = orbit(camera, kUp, glm::radians(90.0), 0);
        expect_near(turned.position, camera.position);
        expect_near(turned.up, {up > 0 ? -1 : 1, 0, 0});
        const Camera lower = orbit(turned, kUp, 0, glm::radians(up > 0 ? -90.0 : 90.0));
        expect_near(lower.position - lower.focal_point, {10, 0, 0});
        expect_near(lower.up, kUp);
    }
}

TEST(Orbit, NearThePolesThePictureDoesNotJump) {
    Camera camera = orbit(test_camera(), kUp, 0.4, glm::radians(88.0));
    for (int i = 0; i < 400; ++i) { // two degrees up to the pole, then down again
        const glm::dvec3 right = eye_axes(camera).right;
        camera = orbit(camera, kUp, 0, glm::radians(i < 200 ? 0.011 : -0.011));
        EXPECT_GT(glm::dot(eye_axes(camera).right, right), 1 - 1e-9) << i;
    }
    expect_near(camera.up, kUp);
}

TEST(Orbit, KeepsAnUpAxisThatIsNotOfLengthOne) {
    Camera camera = test_camera();
    camera.up = {0, 0.5, 0.001};
    const Camera turned = orbit(camera, camera.up, 1, 0.2);
    expect_near(turned.up, camera.up);
    EXPECT_NEAR(distance(turned), 10, 1e-9);
}

TEST(Orbit, AThousandTurnsKeepTheDistance) {
    Camera camera = test_camera();
    for (int i = 0; i < 1000; ++i)
        camera = orbit(camera, kUp, 0.37, i % 2 == 0 ? 0.2 : -0.2);
    EXPECT_NEAR(distance(camera), 10, 1e-9);
}

TEST(Approach, ScalesTheDistanceWithinLimits) {
    const auto after = [](double factor, double radius) {
        return distance(approach(test_camera(), test_camera().focal_point, factor, radius));
    };
    EXPECT_NEAR(after(0.5, 4), 5, 1e-12);
    EXPECT_NEAR(after(0, 4), 4e-3, 1e-12);
    EXPECT_NEAR(after(1e30, 4), 400, 1e-9);
    // A camera beyond the limits may move back, but no further away.
    EXPECT_NEAR(after(2, 1e-6), 10, 1e-12);
    EXPECT_NEAR(after(0.5, 1e-6), 5, 1e-12);
}

TEST(Approach, KeepsTheAnchorWhereItIsInThePicture) {
    const Camera camera = orbit(test_camera(), kUp, 0.3, 0.2);
    for (const glm::dvec3 anchor : {glm::dvec3(2, 1, 4), glm::dvec3(-1, 3, 1), camera.focal_point})
        for (const double factor : {0.1, 0.9, 1.5}) {
            const Camera nearer = approach(camera, anchor, factor, 4);
            EXPECT_NEAR(distance(nearer), 10 * factor, 1e-9);
            EXPECT_NEAR(glm::length(seen(nearer, anchor) - seen(camera, anchor)), 0, 1e-12);
            expect_near(eye_axes(nearer).forward, eye_axes(camera).forward);
        }
}

TEST(Focused, ThePointMovesToTheMiddleAndKeepsItsSize) {
    const glm::dvec3 point(2, 1, 5);
    const Camera camera = focused(test_camera(), point);
    expect_near(camera.focal_point, point);
    expect_near(camera.position, {2, 1, 13}); // it was 8 in front of the eye
    Camera flat = test_camera();
    flat.orthographic = true;
    expect_near(focused(flat, point).position, {2, 1, 15}); // its distance sets the size of all that it sees
}

TEST(Pan, MovesTheFocalPlaneByTheOffset) {
    const Camera camera = pan(test_camera(), {0.25, 0.5});
    const double height = 2 * 10 * std::tan(kDefaultViewAngle / 2);
    expect_near(camera.focal_point, {1 - 0.25 * height, 2 - 0.5 * height, 3});
    expect_near(camera.position - camera.focal_point, {0, 0, 10});
}

TEST(Turn, LooksToTheRightAndUpFromTheSamePlace) {
    const Camera right = turn(test_camera(), kUp, glm::radians(90.0), 0);
    expect_near(right.position, {1, 2, 13});
    expect_near(right.focal_point, {11, 2, 13});
    const Camera up = turn(test_camera(), kUp, 0, glm::radians(30.0));
    expect_near(up.focal_point, {1, 2 + 5, 13 - 10 * std::cos(glm::radians(30.0))});
    const Camera highest = turn(test_camera(), kUp, 0, 50);
    expect_near(highest.focal_point, {1, 12, 13});
    EXPECT_TRUE(is_usable(highest));
}

TEST(Advance, FliesAlongTheViewDirectionAndSideways) {
    const Camera camera = advance(test_camera(), 2, 3);
    expect_near(camera.position, {3, 2, 10});
    expect_near(camera.focal_point, {3, 2, 0});
}

TEST(CameraInput, MeansTheSameAsInOtherViewers) {
    const Camera camera = test_camera();
    const Steering orbiting = steering(CameraMode::orbit, 1);
    // The model follows the mouse: dragged right, its left side comes to the front.
    EXPECT_LT(after_drag(camera, orbiting, Drag::turn, {0.1, 0}).position.x, camera.position.x);
    EXPECT_LT(after_drag(camera, orbiting, Drag::turn, {0, 0.1}).position.y, camera.position.y);
    EXPECT_LT(after_drag(camera, orbiting, Drag::pan, {0.1, 0}).position.x, camera.position.x);
    EXPECT_LT(distance(after_drag(camera, orbiting, Drag::distance, {0, 0.1})), 10);
    const auto wheel = [&](const Camera &from, double notches) {
        return after_wheel(from, orbiting, notches, glm::dvec3(1.5, 2, 3.5));
    };
    EXPECT_NEAR(distance(wheel(camera, 1)), 9, 1e-12);
    EXPECT_NEAR(distance(wheel(wheel(camera, 2.5), -2.5)), 10, 1e-12);
    EXPECT_LT(distance(after_arrows(camera, orbiting, {0, 1})), 10);
    EXPECT_GT(distance(after_arrows(camera, orbiting, {0, -1})), 10);
    EXPECT_GT(after_arrows(camera, orbiting, {1, 0}).position.x, camera.position.x);
}

TEST(CameraInput, FliesThroughTheModel) {
    const Camera camera = test_camera();
    const Steering flying = steering(CameraMode::fly, 10);
    expect_near(after_drag(camera, flying, Drag::turn, {0.1, 0.2}).position, camera.position);
    EXPECT_GT(after_drag(camera, flying, Drag::turn, {0.1, 0}).focal_point.x, camera.focal_point.x);
    EXPECT_GT(after_drag(camera, flying, Drag::turn, {0, 0.1}).focal_point.y, camera.focal_point.y);
    const Camera forward = after_arrows(camera, flying, {0, 4});
    expect_near(forward.position, {1, 2, 13 - 4 * 0.05 * 10});
    expect_near(forward.focal_point - forward.position, {0, 0, -10});
    EXPECT_GT(after_arrows(camera, flying, {1, 0}).position.x, camera.position.x);
    // The wheel flies to what is under the mouse.
    const glm::dvec3 anchor(4, 2, 9);
    expect_near(after_wheel(camera, flying, 1, anchor).position, camera.position + 0.2 * (anchor - camera.position));
}

TEST(CameraInput, AnOrthographicFlightScalesTheView) {
    Camera camera = test_camera();
    camera.orthographic = true;
    const Steering flying = steering(CameraMode::fly, 10);
    EXPECT_LT(distance(after_wheel(camera, flying, 1, {4, 2, 9})), 9.5);
    EXPECT_LT(distance(after_arrows(camera, flying, {0, 1})), 9.6);
    EXPECT_NEAR(distance(after_arrows(camera, flying, {1, 0})), 10, 1e-9);
    EXPECT_GT(after_arrows(camera, flying, {1, 0}).position.x, camera.position.x);
}

// Whatever the input, the model stays within reach.
TEST(CameraInput, DoesNotLoseTheModel) {
    for (const CameraMode mode : {CameraMode::orbit, CameraMode::fly}) {
        const Steering steers = steering(mode, 2);
        Camera camera = test_camera();
        std::uint32_t random = 7;
        const auto unit = [&random] { return (random = random * 1664525 + 1013904223) / 4294967296.0 - 0.5; };
        for (int i = 0; i < 3000; ++i) {
            const glm::dvec3 anchor = steers.bounds.centre + 5.0 * glm::dvec3(unit(), unit(), unit());
            switch (i % 5) {
            case 0: camera = after_drag(camera, steers, Drag::pan, {4 * unit(), 4 * unit()}); break;
            case 1: camera = after_drag(camera, steers, Drag::turn, {4 * unit(), 4 * unit()}); break;
            case 2: camera = after_drag(camera, steers, Drag::distance, {0, 4 * unit()}); break;
            case 3: camera = after_wheel(camera, steers, 20 * unit(), anchor); break;
            case 4: camera = after_arrows(camera, steers, {20 * unit(), 20 * unit()}); break;
            }
            ASSERT_TRUE(is_usable(camera)) << i;
            if (mode == CameraMode::orbit) {
                ASSERT_LE(glm::length(camera.focal_point - steers.bounds.centre), 2 + 1e-9);
                ASSERT_LE(distance(camera), 200 + 1e-9);
                ASSERT_GE(distance(camera), 2e-3 - 1e-9);
            } else {
                ASSERT_LE(glm::length(camera.position - steers.bounds.centre), 200 + 1e-9);
            }
        }
        // A camera that starts far away may stay, but moves no further.
        Camera far = test_camera();
        far.focal_point.x += 1000;
        far.position.x += 1000;
        const Camera farther = after_drag(far, steers, Drag::pan, {-1, 0});
        const auto from_centre = [&](const Camera &from) {
            return glm::length((mode == CameraMode::orbit ? from.focal_point : from.position) - steers.bounds.centre);
        };
        EXPECT_LE(from_centre(farther), from_centre(far) + 1e-9);
        EXPECT_LT(from_centre(after_drag(far, steers, Drag::pan, {1, 0})), from_centre(far) - 1);
    }
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
