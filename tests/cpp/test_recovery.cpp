// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "box_scene.h"
#include "tracking/identity.h"

namespace sdftrack {
namespace {

const Rigidd kPose = pose_at({0, 0, 0.5}), kAway = pose_at({0.08, -0.03, 0.55});

struct Searches : PartsFixture {
  tracking::Recovery recovery{options, &follower};
};

std::optional<Rigidd> believed;  // off by residuals alone

tracking::ObjectResult with_status(tracking::Status status) {
  tracking::ObjectResult result;
  result.trust.status = status;
  result.trust.confidence = 0.8;
  return result;
}

TEST(Recovery, why_nothing_is_found_is_said_by_a_code) {
  Searches parts;
  parts.add({});
  parts.open({}, 0);
  tracking::PoseHint hint;
  hint.box = frame::Rect{40, 40, 100, 90};
  tracking::ObjectResult result = parts.recovery.find(&parts.context, hint, &parts.objects[0], &believed);
  EXPECT_EQ(result.trust.reason.code, tracking::ReasonCode::kNothingFound);
  EXPECT_EQ(parts.objects[0].lost_frames, 1);
  parts.open({kPose}, 0);
  hint.mask = parts.image.mask;
  for (std::size_t i = 0; i < hint.mask.size(); ++i)
    if (hint.mask[i]) parts.image.depth_m[i] = 0;
  result = parts.recovery.find(&parts.context, hint, &parts.objects[0], &believed);
  EXPECT_EQ(result.trust.reason.code, tracking::ReasonCode::kNoReadingInMask);
}

TEST(Recovery, a_find_must_be_confirmed_by_the_next_frame_or_is_taken_back) {
  for (const bool holds : {true, false}) {
    Searches parts;
    parts.add(kPose);
    tracking::TrackedObject& object = parts.objects[0];
    object.lost_frames = 1;
    parts.open({kAway}, 0);
    tracking::ObjectResult found =
        parts.recovery.find_lost(&parts.context, &object, with_status(tracking::Status::kLost));
    ASSERT_EQ(found.trust.status, tracking::Status::kWeak) << tracking::sentence(found.trust.reason);
    EXPECT_EQ(found.trust.reason.code, tracking::ReasonCode::kFoundAgain);
    ASSERT_TRUE(object.before_found);
    EXPECT_LT(norm(found.T_cam_obj.t - kAway.t), 1e-3);
    const tracking::ObjectResult next =
        parts.recovery.confirm(with_status(holds ? tracking::Status::kOk : tracking::Status::kWeak), &object);
    EXPECT_EQ(next.trust.status, holds ? tracking::Status::kOk : tracking::Status::kLost);
    EXPECT_FALSE(object.before_found);
    EXPECT_LT(norm(parts.pose_of(0).t - (holds ? kAway : kPose).t), 1e-3);
    if (!holds) EXPECT_EQ(next.trust.reason.code, tracking::ReasonCode::kNotConfirmed);
  }
}

TEST(Recovery, what_is_not_there_stays_lost_with_the_reason_that_it_had) {
  Searches parts;
  parts.add(kPose);
  parts.objects[0].lost_frames = 1;
  parts.open({}, 0);
  tracking::ObjectResult lost = tracking::result_without_pose(
      parts.objects[0], {tracking::ReasonCode::kFewReadings}, tracking::Status::kLost);
  EXPECT_EQ(parts.recovery.find_lost(&parts.context, &parts.objects[0], lost).trust.reason.code,
            tracking::ReasonCode::kFewReadings);
}

// Two look-alikes, found each at the place of the other.
struct LookAlikes : PartsFixture {
  LookAlikes(double apart_m) {
    const Rigidd left = pose_at({-0.1, 0, 0.6}), right = pose_at({-0.1 + apart_m, 0, 0.6});
    add(right), add(left);
    objects[0].before_found = left, objects[1].before_found = right;
    for (const std::size_t k : {0u, 1u}) {
      results.push_back(with_status(tracking::Status::kWeak));
      results.back().T_cam_obj = pose_of(k);
    }
  }
  std::vector<tracking::ObjectResult> results;
};

TEST(Identity, two_finds_are_given_to_those_that_were_last_nearer_to_them) {
  LookAlikes two(0.2);
  tracking::assign_finds({0, 1}, &two.objects, &two.results);
  EXPECT_NEAR(two.pose_of(0).t.x, -0.1, 1e-12);
  EXPECT_NEAR(two.results[0].T_cam_obj.t.x, -0.1, 1e-12);
  EXPECT_NEAR(two.results[1].T_cam_obj.t.x, 0.1, 1e-12);
  EXPECT_EQ(two.objects[0].doubtful_frames, 0);
}

TEST(Identity, a_find_goes_to_a_look_alike_that_is_still_lost_and_was_nearer) {
  LookAlikes two(0.2);
  two.objects[1].before_found.reset();
  two.objects[1].T_cam_obj = tracking::centred(pose_at({0.11, 0, 0.6}), *two.objects[1].shape);
  two.objects[1].lost_frames = 2;
  two.results[1] = with_status(tracking::Status::kLost);
  tracking::assign_finds({0, 1}, &two.objects, &two.results);
  EXPECT_EQ(two.results[0].trust.status, tracking::Status::kLost);
  EXPECT_EQ(two.results[1].trust.status, tracking::Status::kWeak);
  EXPECT_NEAR(two.pose_of(1).t.x, 0.1, 1e-12);
  EXPECT_EQ(two.objects[0].lost_frames, 1);
  EXPECT_TRUE(two.objects[1].before_found);
}

TEST(Identity, where_nothing_decides_both_are_doubted_for_a_few_frames) {
  PartsFixture parts;
  parts.add(kPose);
  parts.objects[0].doubtful_frames = 2, parts.objects[0].double_of = 3;
  for (const int left : {1, 0}) {
    tracking::ObjectResult result = with_status(tracking::Status::kOk);
    tracking::doubt_identity(&parts.objects[0], &result);
    EXPECT_EQ(result.trust.status, tracking::Status::kWeak);
    EXPECT_EQ(result.trust.confidence, 0.4);
    EXPECT_EQ(tracking::sentence(result.trust.reason), "it may have been swapped with object 3");
    EXPECT_EQ(parts.objects[0].doubtful_frames, left);
  }
  tracking::ObjectResult sure = with_status(tracking::Status::kOk);
  tracking::doubt_identity(&parts.objects[0], &sure);
  EXPECT_EQ(sure.trust.status, tracking::Status::kOk);
}

TEST(Identity, a_frame_that_shows_nothing_is_not_one_of_the_doubtful_ones) {
  PartsFixture parts;
  parts.add(kPose);
  parts.objects[0].doubtful_frames = 2;
  for (const tracking::Status status : {tracking::Status::kLost, tracking::Status::kBadFrame}) {
    tracking::ObjectResult result = with_status(status);
    tracking::doubt_identity(&parts.objects[0], &result);
    EXPECT_EQ(result.trust.status, status);
    EXPECT_EQ(parts.objects[0].doubtful_frames, 2);
  }
}

}  // namespace
}  // namespace sdftrack
