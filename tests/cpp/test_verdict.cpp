// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "box_scene.h"

namespace sdftrack {
namespace {

const Rigidd kPose = pose_at({0, 0, 0.5});

tracking::ObjectResult answer(const Rigidd& T_cam_obj, tracking::Status status = tracking::Status::kOk) {
  tracking::ObjectResult result;
  result.T_cam_obj = T_cam_obj;
  result.covariance = tracking::Matrix6d::Identity();
  result.trust = {status, {}, 0.9, 0.9, 0.8};
  return result;
}

struct Verdicts : PartsFixture {
  tracking::Verdict verdict;

  const tracking::FrameResult& conclude(std::vector<tracking::ObjectResult> answers, double time_s,
                                        const std::vector<int>& served = {0}) {
    verdict.conclude(&objects, served, time_s, &answers);
    return verdict.result();
  }
};

TEST(Verdict, a_twist_needs_two_frames_in_a_row_with_a_pose_and_times_in_order) {
  Verdicts v;
  v.add(kPose);
  v.verdict.start({kPose});
  const auto speed = [&](double x_m, double time_s, tracking::Status status = tracking::Status::kOk) {
    v.verdict.next_frame();
    return v.conclude({answer(pose_at({x_m, 0, 0.5}), status)}, time_s).objects[0].twist[0];
  };
  EXPECT_TRUE(std::isnan(speed(0.0, 1.0)));
  EXPECT_NEAR(speed(0.01, 1.5), 0.02, 1e-12);
  EXPECT_TRUE(std::isnan(speed(0.02, 1.5)));                 // no time has passed
  EXPECT_TRUE(std::isnan(speed(0.02, tracking::kUnknown)));  // nor is it known here,
  EXPECT_TRUE(std::isnan(speed(0.03, 2.0)));                 // and of the frame before
  EXPECT_NEAR(speed(0.04, 2.5), 0.02, 1e-12);
  EXPECT_TRUE(std::isnan(speed(0.04, 3.0, tracking::Status::kLost)));
  EXPECT_TRUE(std::isnan(speed(0.04, 3.5)));
  v.verdict.interrupt();
  EXPECT_TRUE(std::isnan(speed(0.05, 4.0)));
  EXPECT_NEAR(speed(0.06, 4.5), 0.02, 1e-12);
}

TEST(Verdict, a_pose_once_unlikely_must_become_clearly_likely) {
  tracking::TrackedObject object;
  const auto is_ok = [&](double evidence) {
    tracking::ObjectResult result = answer(kPose);
    result.trust.evidence = result.trust.confidence = evidence;
    doubt_unlikely(&object, &result);
    return result.trust.status == tracking::Status::kOk;
  };
  EXPECT_TRUE(is_ok(0.6));
  EXPECT_FALSE(is_ok(0.4));
  EXPECT_FALSE(is_ok(0.6));
  EXPECT_TRUE(is_ok(0.8));
  EXPECT_TRUE(is_ok(0.6));
}

// The origin is not on the axis of the half turn, so that it moves: velocities and covariances move with it.
TEST(Verdict, of_equivalent_poses_the_one_nearest_to_the_last_is_reported) {
  const Rigidd half{rotation_exp(Vec3d{0, 0, M_PI}), {0.04, -0.02, 0}};
  tracking::TrackedObject object;
  object.symmetry.discrete = {half};
  const Rigidd found = {rotation_exp(Vec3d{0.3, -0.2, 0.5}), {0.1, 0.2, 0.6}};
  object.reported = found * half;
  tracking::ObjectResult result = answer(found);
  const auto random = tracking::Matrix6d::Random().eval();
  result.covariance = random * random.transpose();
  result.twist = {0.1, -0.2, 0.3, 1, 2, -3};
  const tracking::ObjectResult before = result;
  report_nearest(&object, &result);
  EXPECT_NEAR(norm(result.T_cam_obj.t - (found * half).t), 0, 1e-12);
  const Vec3d d = result.T_cam_obj.t - found.t;
  const auto of_origin = [&](const tracking::Vector6d& x) {
    const Vec3d moved = cross(Vec3d{x[3], x[4], x[5]}, d);
    return tracking::Vector6d{{x[0] + moved.x, x[1] + moved.y, x[2] + moved.z, x[3], x[4], x[5]}};
  };
  tracking::Matrix6d J;
  for (int i = 0; i < 6; ++i) J.col(i) = of_origin(tracking::Vector6d::Unit(i));
  EXPECT_LT((result.covariance - J * before.covariance * J.transpose()).cwiseAbs().maxCoeff(), 1e-12);
  const tracking::Vector6d twist = of_origin(Eigen::Map<const tracking::Vector6d>(before.twist.data()));
  EXPECT_LT((Eigen::Map<tracking::Vector6d>(result.twist.data()) - twist).cwiseAbs().maxCoeff(), 1e-12);
  // What is lost keeps the pose that was reported.
  tracking::ObjectResult lost = answer(found, tracking::Status::kLost);
  report_nearest(&object, &lost);
  EXPECT_EQ(lost.T_cam_obj.t.x, result.T_cam_obj.t.x);
}

TEST(Verdict, two_in_one_place_are_both_doubted_once) {
  Verdicts v;
  v.add(kPose), v.add(kPose), v.add(pose_at({0.3, 0, 0.5}));
  v.verdict.start({kPose, kPose, kPose});
  const tracking::FrameResult& result =
      v.conclude({answer(kPose), answer(kPose), answer(kPose)}, 0, {0, 1, 2});
  for (const std::size_t k : {0u, 1u}) {
    const tracking::Trust& trust = result.objects[k].trust;
    EXPECT_EQ(trust.status, tracking::Status::kWeak);
    EXPECT_EQ(trust.reason.code, tracking::ReasonCode::kOverlaps);
    EXPECT_EQ(trust.reason.object, 1 - static_cast<int>(k));
    EXPECT_EQ(trust.confidence, 0.4);
  }
  EXPECT_EQ(result.objects[2].trust.status, tracking::Status::kOk);
  // A call that serves the third leaves what was said of the others.
  v.conclude({answer(kPose, tracking::Status::kLost)}, 1, {2});
  EXPECT_EQ(result.objects[0].trust.confidence, 0.4);
  EXPECT_EQ(result.objects[2].trust.status, tracking::Status::kLost);
}

TEST(Sentence, arguments_stand_in_it_and_names_where_they_are_known) {
  EXPECT_EQ(tracking::sentence({}), "");
  EXPECT_EQ(tracking::sentence(tracking::reason_with_percent(tracking::ReasonCode::kHidden, 41)),
            "41 % of the object is occluded");
  EXPECT_EQ(tracking::sentence({tracking::ReasonCode::kUnreadable, 0, -1, "torn"}), "torn");
  const tracking::Reason overlap = tracking::reason_about(tracking::ReasonCode::kOverlaps, 1);
  EXPECT_EQ(tracking::sentence(overlap), "the pose coincides with that of another tracked object: object 1");
  EXPECT_EQ(tracking::sentence(overlap, {"cup", "can"}),
            "the pose coincides with that of another tracked object: can");
}

TEST(Sentence, every_code_has_its_own) {
  for (int a = 1; a < static_cast<int>(tracking::ReasonCode::kCount); ++a)
    for (int b = 0; b < a; ++b)
      EXPECT_NE(tracking::sentence({static_cast<tracking::ReasonCode>(a), 7, 1, "text"}, {"cup", "can"}),
                tracking::sentence({static_cast<tracking::ReasonCode>(b), 7, 1, "text"}, {"cup", "can"}))
          << a << " and " << b;
}

}  // namespace
}  // namespace sdftrack
