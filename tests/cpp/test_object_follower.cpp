// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "box_scene.h"

namespace sdftrack {
namespace {

const Rigidd kPose = pose_at({0, 0, 0.55});
constexpr double kClose_m = 3e-4;  // of a fit to some 2,000 readings of 0.6 mm noise: six standard deviations

Rigidd moved(const Rigidd& T, Vec3d by_m) { return {T.R, T.t + by_m}; }

TEST(ObjectFollower, a_jump_that_the_first_attempt_misses_is_found_by_further_ones) {
  const Rigidd truth = moved(kPose, {0, 0, -0.04});
  for (const bool retries : {false, true}) {
    PartsFixture parts;
    parts.options.retry_inliers = retries ? parts.options.retry_inliers : 0;
    parts.options.scale_start_m = 0.0005;  // one that sees no farther than its residuals' noise
    tracking::ObjectFollower follower(parts.options, parts.settings);
    parts.add(kPose);
    parts.open({truth}, 0);
    const tracking::ObjectResult result = follower.follow(&parts.context, &parts.objects[0]);
    const bool right =
        result.trust.status == tracking::Status::kOk && norm(result.T_cam_obj.t - truth.t) < kClose_m;
    EXPECT_EQ(right, retries);
  }
}

TEST(ObjectFollower, a_lost_object_does_not_take_the_readings_of_its_neighbor) {
  PartsFixture parts;
  parts.add(kPose), parts.add(moved(kPose, {0.01, 0, 0}));
  parts.objects[1].lost_frames = 3;
  parts.open({kPose}, 0);
  const tracking::ObjectResult result = parts.follower.follow(&parts.context, &parts.objects[1]);
  EXPECT_EQ(result.trust.status, tracking::Status::kLost);
  parts.objects[0].lost_frames = 3;  // without the neighbor they are free
  EXPECT_EQ(parts.follower.follow(&parts.context, &parts.objects[1]).trust.status, tracking::Status::kOk);
}

TEST(ObjectFollower, large_residuals_in_a_mask_are_the_sensors_where_the_outline_fits_the_model) {
  PartsFixture parts;
  parts.add(kPose);
  tracking::Fitted fitted;
  fitted.seen = {80, 76, 1, 2, 1, 0.010};  // a mean gap of 10 mm
  fitted.outline = {20, 1, 3};
  fitted.roughness = 5;
  fitted.foreground = -1;
  fitted.covariance = 1e-6 * tracking::Matrix6d::Identity();
  tracking::TrackedObject& object = parts.objects[0];
  object.by_mask_alone = true;
  const double by_depth = parts.follower.judge_followed(fitted, object).evidence;
  object.size.outline.observe({0.0, 0, 1e-4, {}}, kPose.R);
  ASSERT_TRUE(object.size.outline_agrees());
  const double with_outline = parts.follower.judge_followed(fitted, object).evidence;
  EXPECT_LT(by_depth, 0.5);
  EXPECT_GT(with_outline, 0.9);
  object.by_mask_alone = false;
  EXPECT_EQ(parts.follower.judge_followed(fitted, object).evidence, by_depth);
}

}  // namespace
}  // namespace sdftrack
