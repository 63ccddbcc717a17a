// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tracking/fit/local_noise.h"
#include "tracking/trust/trust.h"

namespace sdftrack {
namespace {

tracking::PoseEvidence good_evidence() {
  tracking::PoseEvidence e;
  e.seen = {80, 76, 1, 2, 1, 0.0012};
  e.outline = {20, 1, 3};
  return e;
}

tracking::Matrix6d small_covariance() { return 1e-6 * tracking::Matrix6d::Identity(); }

TEST(Judge, a_pose_with_everything_in_place_is_ok_and_believed) {
  const tracking::Trust trust = tracking::judge(good_evidence(), small_covariance(), {}, 0);
  EXPECT_EQ(trust.status, tracking::Status::kOk);
  EXPECT_TRUE(trust.reason.empty());
  EXPECT_GT(trust.confidence, 0.95);
  EXPECT_NEAR(trust.inliers, 0.95, 1e-9);
}

// Each fault by itself lowers the evidence.
TEST(Judge, every_feature_points_its_way) {
  const double good = tracking::evidence_share(good_evidence(), 0);
  tracking::PoseEvidence e = good_evidence();
  e.seen.gap_m = 0.006;
  EXPECT_LT(tracking::evidence_share(e, 0), good);
  e = good_evidence(), e.seen.farther = 25;
  EXPECT_LT(tracking::evidence_share(e, 0), good);
  e = good_evidence(), e.outline = {2, 19, 3};
  EXPECT_LT(tracking::evidence_share(e, 0), good);
  e = good_evidence(), e.seen.missing = 40;
  EXPECT_LT(tracking::evidence_share(e, 0), good);
  e = good_evidence(), e.roughness = 5;
  EXPECT_LT(tracking::evidence_share(e, 0), good);
  e = good_evidence(), e.seen.gap_m = 0.012, e.roughness = 8;
  EXPECT_LT(tracking::evidence_share(e, 0),
            0.5 * tracking::evidence_share(tracking::but_for_residuals(e), 0));
  e.seen.agree = e.seen.expected / 4, e.seen.farther = 3 * e.seen.expected / 4;
  EXPECT_LT(tracking::evidence_share(tracking::but_for_residuals(e), 0), 0.02);
  e = good_evidence(), e.color_gain = -0.4;
  EXPECT_LT(tracking::evidence_share(e, 0), good);
  e.color_gain = 0.2;
  EXPECT_GT(tracking::evidence_share(e, 0), good);
  e.color_gain = 0;  // colours that say nothing
  EXPECT_EQ(tracking::evidence_share(e, 0), good);
}

TEST(Judge, what_a_hand_hides_is_weak_for_that_reason_and_what_is_seen_past_is_lost) {
  tracking::PoseEvidence e = good_evidence();
  e.seen = {80, 14, 0, 66, 0, 0.0012};
  tracking::Trust trust = tracking::judge(e, small_covariance(), {}, 0);
  EXPECT_EQ(trust.status, tracking::Status::kWeak);
  EXPECT_NE(tracking::sentence(trust.reason).find("occluded"), std::string::npos);
  e.seen = {80, 16, 60, 0, 4, 0.02};
  trust = tracking::judge(e, small_covariance(), {}, 0);
  EXPECT_EQ(trust.status, tracking::Status::kLost);
  EXPECT_EQ(trust.confidence, 0);
}

TEST(Judge, an_object_that_was_there_a_moment_ago_is_lost_only_by_stronger_evidence) {
  tracking::PoseEvidence e = good_evidence();
  e.seen.farther = 11, e.seen.gap_m = 0.008, e.roughness = 10;
  EXPECT_EQ(tracking::judge(e, small_covariance(), {}, 0).status, tracking::Status::kLost);
  EXPECT_EQ(tracking::judge(e, small_covariance(), {}, 0, 3).status, tracking::Status::kWeak);
  e.seen = {80, 16, 60, 0, 4, 0.02};  // the sensor sees past it
  EXPECT_EQ(tracking::judge(e, small_covariance(), {}, 0, 3).status, tracking::Status::kLost);
}

TEST(DepthError, a_patch_of_wrong_depth_is_tolerated_as_far_as_the_sensor_is_known_to_err) {
  EXPECT_DOUBLE_EQ((tracking::DepthError{0.0001}.tolerance(0.004, 4)), 0.004);
  EXPECT_DOUBLE_EQ((tracking::DepthError{0.002}.tolerance(0.004, 4)), 0.008);
  EXPECT_DOUBLE_EQ((tracking::DepthError{0.002, 0.006}.tolerance(0.004, 4)), 0.015);
}

TEST(Judge, a_free_direction_is_not_believed_though_the_evidence_is_good) {
  tracking::Matrix6d C = small_covariance();
  C(5, 5) = 9.87;
  const tracking::Trust trust = tracking::judge(good_evidence(), C, {}, 0);
  EXPECT_EQ(trust.status, tracking::Status::kOk);
  EXPECT_LT(trust.confidence, 0.1);
}

TEST(LocalNoise, it_is_the_sd_of_the_readings_of_a_slanted_plane_whatever_the_stride) {
  std::mt19937 random(0);
  std::normal_distribution<float> noise(0, 0.002f);
  std::vector<float> scratch;
  for (const int stride : {1, 2}) {
    energies::PixelSet pixels;
    for (int v = 0; v < 60; ++v)
      for (int u = 0; u < 60; u += stride)
        pixels.push(static_cast<float>(u), static_cast<float>(v),
                    0.8f + 0.001f * static_cast<float>(u) - 0.0007f * static_cast<float>(v) + noise(random),
                    1.0f);
    // The sd of a median of 400 is 5 %, three of them.
    EXPECT_NEAR(tracking::local_noise_m(pixels, &scratch), 0.002, 3e-4) << "stride " << stride;
  }
}

TEST(LocalNoise, too_few_readings_say_nothing) {
  energies::PixelSet pixels;
  for (int u = 0; u < 10; ++u) pixels.push(static_cast<float>(u), 0, 0.8f, 1.0f);
  std::vector<float> scratch;
  EXPECT_EQ(tracking::local_noise_m(pixels, &scratch), 0);
}

}  // namespace
}  // namespace sdftrack
