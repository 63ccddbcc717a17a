// SPDX-License-Identifier: MIT
// Depth-to-colour maps from pairs of a ball's centres: derivatives, exact pairs, outliers, the path between
// frames.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <random>

#include "base/normal.h"
#include "calibration/registration/first_map.h"
#include "calibration/registration/resection.h"

namespace sdftrack {
namespace {

using namespace calibration;

const Camera kDepth{{262, 263, 159, 120.5}, 320, 240, {}};
const Camera kColor{{305, 306, 161, 118}, 320, 240, {}};
const Camera kLens{{305, 306, 161, 118}, 320, 240, {0.1, -0.2, 0.001, -0.001, 0.05}};
const Rigidd kTrue{rotation_exp(Vec3d{0.02, -0.03, 0.01}), {-0.025, 0.002, -0.004}};

DepthToColor true_map() {
  ProjectiveMatrix M;
  const Vec3d rows[] = {kTrue.R.r0, kTrue.R.r1, kTrue.R.r2};
  for (int i = 0; i < 3; ++i) M.row(i) << rows[i].x, rows[i].y, rows[i].z, 0;
  M.col(3) << kTrue.t.x, kTrue.t.y, kTrue.t.z;
  Eigen::Matrix3d K;
  K << kColor.K.fx, 0, kColor.K.cx, 0, kColor.K.fy, kColor.K.cy, 0, 0, 1;
  return DepthToColor(ProjectiveMatrix(K * M));
}

Vec3d on_path(double t) {
  return {0.25 * std::sin(2.1 * t), 0.18 * std::sin(2.9 * t + 1), 0.8 + 0.25 * std::sin(1.3 * t + 0.4)};
}

BallPairs simulated(const DepthToColor& truth, int n, double noise_px, double late_s = 0) {
  std::mt19937_64 random(4);
  Normal normal;
  BallPairs out(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    BallPair& pair = out[static_cast<std::size_t>(i)];
    pair.index = i, pair.time_s = i / 15.0;
    pair.center_cam = on_path(pair.time_s);
    pair.center_covariance = 1e-12 * Eigen::Matrix3d::Identity();
    const Vec2d px = truth.pixel(on_path(pair.time_s + late_s));
    pair.color_px = {px.x + noise_px * normal(random), px.y + noise_px * normal(random)};
    pair.color_covariance = std::pow(std::max(noise_px, 0.01), 2) * Eigen::Matrix2d::Identity();
  }
  return out;
}

class EitherMap : public testing::TestWithParam<DepthToColor> {};
INSTANTIATE_TEST_SUITE_P(Maps, EitherMap, testing::Values(true_map(), DepthToColor(kTrue, kLens)));

TEST_P(EitherMap, has_the_derivatives_of_differences) {
  const DepthToColor& map = GetParam();
  constexpr double kStep = 1e-6;
  const Eigen::VectorXd scales = map.scales();
  const DepthToColor::Pq Pq = map.Pq_of(kDepth.K);
  for (const double t : {0.0, 0.7, 1.9, 3.1}) {
    const Vec3d p = on_path(t);
    const DepthToColor::Pixel at = map.at(p);
    const double size = (at.by_map.leftCols(map.unknowns()) * scales.asDiagonal()).cwiseAbs().maxCoeff();
    for (int k = 0; k < map.unknowns(); ++k) {
      const Eigen::VectorXd step = kStep * scales[k] * Eigen::VectorXd::Unit(map.unknowns(), k);
      const Vec2d ahead = map.moved(step).pixel(p), behind = map.moved(-step).pixel(p);
      EXPECT_NEAR(at.by_map(0, k) * scales[k], (ahead.x - behind.x) / (2 * kStep), 2e-4 * size);
      EXPECT_NEAR(at.by_map(1, k) * scales[k], (ahead.y - behind.y) / (2 * kStep), 2e-4 * size);
      const Eigen::VectorXd by_map =
          (map.moved(step).Pq_of(kDepth.K).values - map.moved(-step).Pq_of(kDepth.K).values) / (2 * kStep);
      EXPECT_LT((Pq.by_map.col(k) * scales[k] - by_map).cwiseAbs().maxCoeff(), 1e-5 * (1 + by_map.norm()));
    }
    const Vec2d ahead = map.pixel(p + Vec3d{0, 0, kStep}), behind = map.pixel(p - Vec3d{0, 0, kStep});
    EXPECT_NEAR(at.by_point(0, 2), (ahead.x - behind.x) / (2 * kStep), 0.1);
  }
}

TEST_P(EitherMap, is_found_from_exact_pairs) {
  const Camera* color = GetParam().is_projective() ? nullptr : &kLens;
  const std::optional<MapFit> fit = first_map(simulated(GetParam(), 40, 0), color, false, 0);
  ASSERT_TRUE(fit);
  for (const Vec2d r : fit->residual_px) EXPECT_LT(std::hypot(r.x, r.y), 1e-6);
  EXPECT_LT((fit->map.Pq_of(kDepth.K).values - GetParam().Pq_of(kDepth.K).values).norm(), 1e-5);
}

TEST_P(EitherMap, is_found_among_wrong_pairs_and_with_colour_late_by_several_frames) {
  const Camera* color = GetParam().is_projective() ? nullptr : &kLens;
  for (const double late : {0.13, -0.13}) {
    BallPairs pairs = simulated(GetParam(), 48, 0.1, late);
    for (std::size_t i = 4; i < pairs.size(); i += 6) pairs[i].color_px.x += 40;
    const std::optional<MapFit> fit = first_map(pairs, color, true, 0);
    ASSERT_TRUE(fit);
    EXPECT_NEAR(fit->offset_s, late, 0.003);
    const int n = fit->map.unknowns();
    EXPECT_LT(std::abs(fit->offset_s - late), 4 * std::sqrt(fit->covariance(n, n)));
    for (std::size_t i = 4; i < pairs.size(); i += 6) EXPECT_FALSE(fit->kept[i]);
    EXPECT_GE(count_of(fit->kept), 34U);
  }
}

TEST(Resection, one_of_the_poses_of_three_points_is_the_true_one) {
  const Vec3d p[] = {on_path(0), on_path(0.8), on_path(1.9)};
  Vec3d rays[3];
  for (int i = 0; i < 3; ++i) rays[i] = (1 / norm(kTrue * p[i])) * (kTrue * p[i]);
  double least = 1;
  for (const Rigidd& T : poses_of_three(p, rays)) {
    EXPECT_LT(orthogonality_error(T.R), 1e-12);
    const Rigidd off = T * inverse(kTrue);
    least = std::min(least, norm(off.t) + rotation_angle(off.R));
  }
  EXPECT_LT(least, 1e-7);
  const Vec3d line[] = {p[0], p[1], 0.5 * (p[0] + p[1])};
  EXPECT_TRUE(poses_of_three(line, rays).empty());
}

TEST(DepthToColor, taken_apart_gives_the_camera_and_its_place) {
  const auto found = decompose(3.7 * true_map().M());
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->K(0, 0), kColor.K.fx, 1e-9);
  EXPECT_NEAR(found->K(0, 1), 0, 1e-9);
  EXPECT_NEAR(found->K(1, 2), kColor.K.cy, 1e-9);
  EXPECT_LT(norm(found->T_color_depth.t - kTrue.t), 1e-12);
  EXPECT_LT(rotation_angle(found->T_color_depth.R * transpose(kTrue.R)), 1e-9);
  EXPECT_FALSE(decompose(-true_map().M()));
}

TEST(BallPath, ends_at_its_ends_and_is_not_carried_over_gaps) {
  std::vector<TimedPoint> points;
  for (const double t : {0.0, 0.1, 0.2, 0.3, 0.9, 1.0, 1.1}) points.push_back({t, {t, t, 1 + t}});
  const BallPath path(points);
  for (const double t : {-0.01, 0.5, 1.2}) EXPECT_FALSE(path.at(t));
  for (const double t : {0.0, 0.15, 0.95}) {
    const auto at = path.at(t);
    ASSERT_TRUE(at);
    EXPECT_NEAR(at->center_cam.z, 1 + t, 1e-12);
    EXPECT_NEAR(at->velocity.x, 1, 1e-10);
  }
}

TEST(BallPath, a_point_that_jumps_aside_is_no_part_of_it) {
  std::vector<TimedPoint> points;
  for (int i = 0; i < 40; ++i) points.push_back({i / 15.0, on_path(i / 15.0)});
  points[7].center_cam.y += 0.3, points[20].center_cam.x += 0.5;
  const BallPath path = BallPath::through(points);
  for (int i = 3; i < 37; ++i)  // two periods are bridged
    EXPECT_LT(norm(path.at(i / 15.0)->center_cam - on_path(i / 15.0)), 0.002);
}

}  // namespace
}  // namespace sdftrack
