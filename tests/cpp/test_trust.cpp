// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tracking/alternatives.h"
#include "tracking/fit/local_noise.h"
#include "tracking/fit/outline_noise.h"
#include "tracking/size/size_test.h"
#include "tracking/trust/open_directions.h"
#include "tracking/trust/trust.h"
#include "tracking/trust/visibility.h"
#include "volume_fixture.h"

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

frame::Shape shape_of(const Volume& volume) { return frame::make_shape(volume.view(), 960, 60); }

const Volume& can() {
  static const Volume volume = make_volume(60, 0.08, [](Vec3d p) {
    const double r = std::hypot(p.x, p.y) - 0.033, h = std::abs(p.z) - 0.05;
    return std::min(std::max(r, h), 0.0) + std::hypot(std::max(r, 0.0), std::max(h, 0.0));
  });
  return volume;
}

TEST(Slips, a_can_has_one_a_ball_three_and_a_box_none) {
  const frame::Shape shape = shape_of(can());
  ASSERT_EQ(shape.slips.size(), 1u);
  EXPECT_NEAR(std::abs(shape.slips[0][5]), 1, 1e-3);  // the turn about z
  const Volume ball = make_volume(50, 0.06, [](Vec3d p) { return norm(p) - 0.04; });
  EXPECT_EQ(shape_of(ball).slips.size(), 3u);
  const Volume box = make_volume(60, 0.09, [](Vec3d p) { return box_distance(p, {0.06, 0.045, 0.03}); });
  EXPECT_TRUE(shape_of(box).slips.empty());
}

// The obvious sum over all points, and what noise leaves of it.
TEST(Slips, smooth_normals_are_means_of_half_the_points_each) {
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  std::vector<Vec3f> points, normals;
  for (int i = 0; i < 400; ++i) {
    const Vec3f d = {normal(random), normal(random), normal(random)}, n = (1 / norm(d)) * d;
    const Vec3f rough = n + 0.3f * Vec3f{normal(random), normal(random), normal(random)};
    points.push_back(0.05f * n), normals.push_back((1 / norm(rough)) * rough);
  }
  const auto smooth = frame::smooth_normals(points, normals, 0.02);
  double before = 0, after = 0;
  for (std::size_t half = 0; half < 2; ++half)
    for (std::size_t k = 0; k < smooth[half].size(); ++k) {
      const std::size_t i = frame::kSmoothEvery * k;
      Vec3d sum = 1e-3 * normals[i].cast<double>();
      for (std::size_t j = half; j < points.size(); j += 2)
        if (norm(points[j] - points[i]) < 0.02f && dot(normals[j], normals[i]) > 0)
          sum = sum + normals[j].cast<double>();
      EXPECT_LT(norm(smooth[half][k].cast<double>() - (1 / norm(sum)) * sum), 1e-4);
      const Vec3d truth = 20.0 * points[i].cast<double>();
      before += norm(normals[i].cast<double>() - truth),
          after += norm(smooth[half][k].cast<double>() - truth);
    }
  EXPECT_LT(after, 0.6 * before);
}

// A ball before a wall; within two pixels of its outline a measurement is the mean of 5 x 5 pixels.
tracking::Visibility seen_ball(double radius_m, double model_radius_m) {
  constexpr int kWidth = 160, kHeight = 120;
  const Camera camera{{280, 280, 79.5, 59.5}, kWidth, kHeight, {}};
  const double away_m = 0.6;
  const auto exact = [&](int u, int v) {
    const Vec3d r = camera.pixel_ray(u, v);
    const double rr = dot(r, r), b = away_m * r.z / rr,
                 left = b * b - (away_m * away_m - radius_m * radius_m) / rr;
    return left > 0 ? b - std::sqrt(left) : 0.9;
  };
  std::vector<float> depth_m;
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      double sum = 0, least = 1, most = 0;
      for (int k = 0; k < 25; ++k) {
        const double z = exact(u + k % 5 - 2, v + k / 5 - 2);
        sum += z, least = std::min(least, z), most = std::max(most, z);
      }
      depth_m.push_back(static_cast<float>(most - least > 0.1 ? sum / 25 : exact(u, v)));
    }
  const Volume ball = make_volume(60, 0.08, [&](Vec3d p) { return norm(p) - model_radius_m; });
  return tracking::compare_visible({{depth_m.data(), kWidth, kHeight}, nullptr, nullptr}, camera,
                                   shape_of(ball), {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, away_m}},
                                   {0.001}, {});
}

TEST(Visibility, what_is_mixed_at_the_edge_of_a_ball_says_nothing_against_it) {
  const tracking::Visibility right = seen_ball(0.05, 0.05), large = seen_ball(0.05, 0.058);
  EXPECT_GT(right.agree, 0.6 * right.expected);
  EXPECT_LT(right.farther, 0.02 * right.expected);
  EXPECT_GT(large.farther, 0.1 * large.expected);
}

// Information about a can's own turn is none of an outline's.
TEST(Slips, they_are_taken_out_of_an_information_and_nothing_else) {
  const frame::Shape shape = shape_of(can());
  const tracking::Matrix6d left = tracking::without_slips(tracking::Matrix6d::Identity(), shape);
  EXPECT_LT(left(5, 5), 1e-4);
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(left(i, i), 1, 0.01);
}

TEST(OpenDirections, a_turn_without_information_is_open_and_loses_its_velocity) {
  const frame::Shape shape = shape_of(can());
  const Rigidd T{{{1, 0, 0}, {0, 0, -1}, {0, 1, 0}},
                 {0.01, 0.02, 0.6}};  // z of the can along -y of the camera
  tracking::Matrix6d C = 1e-6 * tracking::Matrix6d::Identity();
  EXPECT_TRUE(tracking::OpenDirections(C, T, shape).empty());
  C(4, 4) = 9;  // about the camera's y
  const tracking::OpenDirections open(C, T, shape);
  ASSERT_FALSE(open.empty());
  EXPECT_EQ(open.unexplained({}, false),
            "the rotation about the axis (0.00, 0.00, 1.00) is not observed; pass symmetry= or a mesh with "
            "colours");
  const Rigidd turn{rotation_exp(Vec3d{0, 0, 0.02}), {0, 0, 0}}, other{rotation_exp(Vec3d{0.02, 0, 0}), {}};
  EXPECT_EQ(open.unexplained({turn}, false), "");
  EXPECT_NE(open.unexplained({other}, false), "");
  EXPECT_EQ(open.unexplained({}, true), "");
  Vec3d v{0.1, 0.2, 0.3}, w{0.4, 5, 0.6};
  open.remove_from(T, &v, &w);
  EXPECT_NEAR(norm(v - Vec3d{0.1, 0.2, 0.3}), 0, 1e-3);
  EXPECT_NEAR(norm(w - Vec3d{0.4, 0, 0.6}), 0, 0.01);  // of 5: 960 points are not quite a body of revolution
  // A turn by one degree is as unlikely under the prior as three sd of its step.
  const tracking::Matrix6d held = open.hold();
  EXPECT_GT(held(5, 5) * std::pow(0.0175, 2), 5);
  EXPECT_LT(held(0, 0) * std::pow(0.001, 2), 0.1);
}

// The same size in every look: the sd of what differs from look to look falls, the shared one stays.
TEST(SizeWitness, errors_of_one_view_do_not_average) {
  tracking::SizeWitness witness;
  for (int i = 0; i < 20; ++i)
    witness.observe({0.05, 1e-4, 1e-6, {}}, Mat3d{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  EXPECT_NEAR(witness.log_scale(), 0.05, 1e-12);
  EXPECT_NEAR(witness.sd(), std::sqrt(1e-4 / 20 + 1e-6), 1e-9);
  witness.observe({0.05, 1e-4, 1e-6, {}}, rotation_exp(Vec3d{0, 0.5, 0}));
  EXPECT_NEAR(witness.sd(), std::sqrt(1e-4 / 21 + 0.5e-6), 1e-9);
}

TEST(SizeTest, an_outline_of_the_right_size_contradicts_depth) {
  tracking::SizeTest size;
  const Mat3d R{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  size.depth.observe({0.06, 1e-6, 1e-6, {}}, R);
  EXPECT_NE(size.other_size().find("6.2 % larger"), std::string::npos);
  size.outline.observe({0.0, 0, 1e-4, {}}, R);
  EXPECT_TRUE(size.other_size().empty());
  EXPECT_TRUE(size.outline_agrees());
  tracking::SizeTest small;
  small.depth.observe({-0.03, 1e-6, 4e-4, {}}, R);  // 3 % by a sensor that may bend by 2 %
  EXPECT_TRUE(small.other_size().empty());
}

// An outline with an sd of 1 %: 2.7 % off is too much at first, not after it has agreed; 4.5 % is at any
// time.
TEST(SizeTest, an_outline_that_has_agreed_is_contradicted_by_more) {
  const Mat3d R{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const auto agrees = [&](double log_scale, bool before) {
    tracking::SizeTest size;
    size.outline_has_agreed = before;
    size.outline.observe({log_scale, 0, 1e-4, {}}, R);
    return size.outline_agrees();
  };
  EXPECT_FALSE(agrees(0.027, false));
  EXPECT_TRUE(agrees(0.027, true));
  EXPECT_FALSE(agrees(0.045, true));
}

// Depth sees a stretch by 20 % along x; the outline knows that direction only.
TEST(SizeTest, an_outline_of_the_models_form_contradicts_depth_that_bends) {
  const tracking::Strain along_x{{0.2 * std::sqrt(0.5), 0.2 * std::sqrt(1 / 6.0), 0, 0, 0}};
  const tracking::StrainCovariance small = 1e-6 * tracking::StrainCovariance::Identity();
  const tracking::StrainCovariance known = 400 * along_x * along_x.transpose() / along_x.squaredNorm();
  const auto said = [&](double share, double information, double unexplained = 1) {
    tracking::SizeTest size;
    size.form.observe({along_x, small, small, unexplained}, Mat3d{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
    size.form_outline.observe({information * known, information * share * known * along_x});
    return size.other_form();
  };
  EXPECT_NE(said(0.8, 1).find("22 % longer than the model along (1.00, 0.00, 0.00)"), std::string::npos);
  EXPECT_TRUE(said(0, 1).empty());
  EXPECT_FALSE(said(0, 1e-3).empty());      // which does not tell
  EXPECT_TRUE(said(0, 1e-3, 2.5).empty());  // of a sensor that bends more than the strain explains
  EXPECT_FALSE(said(0.8, 1, 2.5).empty());
}

TEST(Unproven, a_turn_after_a_loss_is_believed_after_enough_sure_frames_in_a_row) {
  tracking::TrackedObject object;
  object.unproven_frames = tracking::kProvingFrames;
  const auto said = [&](tracking::Status status) {
    tracking::ObjectResult result;
    result.trust.status = status;
    tracking::doubt_unproven(&object, &result);
    return result.trust.status;
  };
  for (int i = 1; i < tracking::kProvingFrames; ++i)
    EXPECT_EQ(said(tracking::Status::kOk), tracking::Status::kWeak);
  EXPECT_EQ(said(tracking::Status::kLost), tracking::Status::kLost);  // from the beginning again
  for (int i = 0; i < tracking::kProvingFrames; ++i)
    EXPECT_EQ(said(tracking::Status::kOk), tracking::Status::kWeak);
  EXPECT_EQ(said(tracking::Status::kOk), tracking::Status::kOk);
}

TEST(Disagreement, what_only_one_of_two_knows_is_no_way_between_them) {
  tracking::Disagreement apart;
  apart.way << 0.005, 0.005, 0, 0, 0, 0;
  apart.covariance.diagonal() << 1e-8, 1e-2, 1e-8, 1e-6, 1e-6, 1e-6;  // y is known to 10 cm
  apart.apart_m = 0.005;
  const tracking::Vector6d unit = tracking::Vector6d::Ones();
  EXPECT_EQ(apart.sure_way(unit), tracking::Vector6d::Zero());  // not surely apart
  apart.excess = 3;
  const tracking::Vector6d sure = apart.sure_way(unit);
  EXPECT_NEAR(sure[0], 0.005, 1e-5);
  EXPECT_LT(std::abs(sure[1]), 2e-5);
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
