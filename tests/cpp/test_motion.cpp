// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "tracking/motion.h"

namespace sdftrack {
namespace {

constexpr double kTolerance = 1e-12;  // rotations are composed twice: rounding alone

Rigidd screw(double t) { return {rotation_exp(Vec3d{0.3 * t, -0.2 * t, 0.1 * t}), {0.1 + 2 * t, -t, 0.5}}; }

void expect_same(const Rigidd& a, const Rigidd& b) {
  EXPECT_LT(norm(a.t - b.t), kTolerance);
  EXPECT_LT(rotation_angle(transpose(a.R) * b.R), 1e-7);
}

TEST(ConstantVelocity, knows_nothing_before_two_poses) {
  tracking::ConstantVelocity motion;
  expect_same(motion.predict(screw(0.4), 1), screw(0.4));
  motion.observe(screw(0), 0);
  expect_same(motion.predict(screw(0), 0.1), screw(0));
}

TEST(ConstantVelocity, goes_on_by_the_time_that_passes) {
  tracking::ConstantVelocity motion;
  motion.observe(screw(0.0), 10.0);
  motion.observe(screw(0.1), 10.1);
  expect_same(motion.predict(screw(0.1), 10.2), screw(0.2));
  expect_same(motion.predict(screw(0.1), 10.4), screw(0.4));  // three frames were dropped
}

TEST(ConstantVelocity, counts_frames_where_there_are_no_times) {
  tracking::ConstantVelocity motion;
  motion.observe(screw(0.0), tracking::kNoTime);
  motion.observe(screw(0.1), tracking::kNoTime);
  expect_same(motion.predict(screw(0.1), tracking::kNoTime), screw(0.2));
}

TEST(ConstantVelocity, is_believed_less_in_every_frame_without_a_sure_pose) {
  tracking::ConstantVelocity motion;
  motion.observe(screw(0.0), 0.0);
  motion.observe(screw(0.1), 0.1);
  motion.pass();
  const double once = norm(motion.predict(screw(0.2), 0.3).t - screw(0.2).t);
  motion.pass();
  const double twice = norm(motion.predict(screw(0.2), 0.4).t - screw(0.2).t);
  const double full = norm(screw(0.1).t - screw(0.0).t);
  EXPECT_NEAR(once, 0.7 * full, 1e-9);
  EXPECT_NEAR(twice, 0.49 * full, 1e-9);
}

TEST(ConstantVelocity, says_nothing_across_a_gap_or_a_change_of_unit) {
  tracking::ConstantVelocity motion;
  motion.observe(screw(0.0), 0.0);
  motion.observe(screw(0.1), 0.1);
  expect_same(motion.predict(screw(0.1), 5.0), screw(0.1));
  expect_same(motion.predict(screw(0.1), tracking::kNoTime), screw(0.1));
  motion.reset();
  expect_same(motion.predict(screw(0.1), 0.2), screw(0.1));
}

}  // namespace
}  // namespace sdftrack
