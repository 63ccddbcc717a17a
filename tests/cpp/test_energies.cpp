// SPDX-License-Identifier: MIT
// Fields, penalties and terms, in double: derivatives against finite differences.
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "energies/reduce_cpu.h"
#include "energies/sdf_energy.h"
#include "energies/term.h"
#include "tracking/fit/free_space.h"
#include "volume_fixture.h"

namespace sdftrack {
namespace {

const Volume kBox = make_volume(40, 0.1, [](Vec3d p) { return box_distance(p, {0.05, 0.03, 0.04}); });
const Rigidd kPose = inverse(Rigidd{rotation_exp(Vec3d{0.5, -0.4, 0.3}), {0.01, -0.02, 0.5}});  // T_obj_cam
const Intrinsics<double> kCamera{525, 520, 160, 120};

// Relative to the largest entry: double arithmetic on float volumes, and no kink within 1e-7 m of most
// points.
constexpr double kDerivativeTolerance = 1e-5;

template <class Field, class Move>
void expect_columns(const Field& field, Vec3d p_cam, const Move& move) {
  energies::FieldRow<double, Field::P> row, up, down;
  field.row(p_cam, &row);
  double value;
  Vec3d g;
  field.value(p_cam, &value, &g);
  EXPECT_EQ(value, row.phi_m);
  const double h = 1e-7;
  for (int j = 0; j < Field::P; ++j) {
    double step = h;
    const auto [field_up, point_up] = move(field, p_cam, j, &step);
    field_up.row(point_up, &up);
    double minus = -h;
    const auto [field_down, point_down] = move(field, p_cam, j, &minus);
    field_down.row(point_down, &down);
    EXPECT_NEAR((up.phi_m - down.phi_m) / (step - minus), row.J[j], kDerivativeTolerance) << "column " << j;
  }
}

Rigidd moved(const Rigidd& T, int j, double h) {
  double d[6] = {};
  d[j] = h;
  return increment(Vec3d{d[0], d[1], d[2]}, Vec3d{d[3], d[4], d[5]}) * T;
}

std::vector<Vec3d> some_points() {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(-0.12, 0.12);  // some lie outside the volume
  std::vector<Vec3d> points;
  for (int i = 0; i < 100; ++i) points.push_back(inverse(kPose) * Vec3d{u(random), u(random), u(random)});
  return points;
}

template <int K>
energies::SoftMin<K, double> touching_boxes(double sharpness_per_m) {
  energies::SoftMin<K, double> field;
  for (int k = 0; k < K; ++k) {
    const Rigidd there{rotation_exp(Vec3d{0.3 * k, 0.1, -0.2 * k}), {0.05 * k, 0.01 * k, -0.02 * k}};
    field.object[k] = {kBox.view(), there * kPose};
  }
  field.sharpness_per_m = sharpness_per_m;
  return field;
}

template <int K>
void expect_columns_of_a_union() {
  for (const double sharpness_per_m : {100.0, 2000.0})
    for (const Vec3d& p : some_points())
      expect_columns(touching_boxes<K>(sharpness_per_m), p,
                     [](energies::SoftMin<K, double> f, Vec3d point, int j, double* h) {
                       f.object[j / 6].T_obj_cam = moved(f.object[j / 6].T_obj_cam, j % 6, *h);
                       return std::pair{f, point};
                     });
}
TEST(Field, the_columns_of_a_union_are_derivatives) {
  expect_columns_of_a_union<2>();
  expect_columns_of_a_union<3>();
  expect_columns_of_a_union<4>();
}

// 40 per voxel: at the default four surfaces that meet in one point stay within 0.05 voxel of it.
TEST(Field, a_union_lies_below_its_nearest_object_by_the_logarithm_of_their_number) {
  energies::SoftMin<4, double> field;
  for (auto& object : field.object) object = {kBox.view(), kPose};
  const float voxel_m = kBox.view().voxel_m;
  field.sharpness_per_m = static_cast<double>(energies::SdfEnergyOptions{}.sharpness / voxel_m);
  for (const Vec3d& p : some_points()) {
    double joined, own;
    Vec3d unused;
    field.value(p, &joined, &unused);
    field.object[0].value(p, &own, &unused);
    EXPECT_NEAR(own - joined, std::log(4) / field.sharpness_per_m, 1e-12);
    EXPECT_LT(own - joined, 0.05 * static_cast<double>(voxel_m));
  }
}

TEST(Field, far_from_all_others_a_union_is_its_object) {
  const energies::SoftMin<3, double> field = touching_boxes<3>(1e4);
  for (const Vec3d& p : some_points()) {
    double joined, least = 1, own;
    Vec3d unused;
    field.value(p, &joined, &unused);
    int near = 0;
    for (const auto& object : field.object) object.value(p, &own, &unused), least = std::min(least, own);
    for (const auto& object : field.object) object.value(p, &own, &unused), near += own < least + 5e-3;
    if (near == 1) EXPECT_NEAR(joined, least, 1e-12);
  }
}

TEST(Penalty, slope_and_second_derivative_are_derivatives_of_the_cost) {
  for (const double floor : {0.0, 0.1})
    for (double r = -0.02; r < 0.02; r += 0.0007) {
      const energies::DepthLogistic<double> penalty{0.002, floor};
      const double noise = 1.3, h = 1e-8;
      EXPECT_NEAR((penalty(r + h, noise).cost - penalty(r - h, noise).cost) / (2 * h),
                  penalty(r, noise).slope, 1e-3);
      EXPECT_NEAR((penalty(r + h, noise).slope - penalty(r - h, noise).slope) / (2 * h),
                  penalty.second_derivative(r, noise), 20);
    }
}

TEST(Penalty, behind_the_surface_it_may_have_another_floor) {
  const energies::DepthLogistic<double> one{0.002, 0.3}, other{0.002, 0.02},
      both{0.002, 0.3, energies::Curvature::kIrls, 0.02};
  for (const double r : {1e-4, 0.003, 0.01}) {
    EXPECT_EQ(both(r, 1.0).cost, one(r, 1.0).cost);
    EXPECT_EQ(both(-r, 1.0).cost, other(-r, 1.0).cost);
    EXPECT_EQ(both(-r, 1.0).slope, other(-r, 1.0).slope);
  }
  EXPECT_NEAR(both(1e-12, 1.0).cost, both(-1e-12, 1.0).cost, 1e-12);  // no step between the two
}

TEST(Penalty, with_a_floor_a_far_residual_pulls_no_more) {
  const energies::DepthLogistic<double> penalty{0.002, 0.1};
  EXPECT_NEAR(penalty(0.1, 1.0).cost, -std::log(0.1), 1e-9);
  EXPECT_LT(penalty(0.1, 1.0).slope, 1e-12);
  EXPECT_TRUE(std::isfinite(penalty(1e6, 1.0).cost));
}

template <class P>
void expect_derivatives(const P& penalty, double r, double foreground) {
  const double noise = 1.3, h = 1e-8;
  EXPECT_NEAR((penalty(r + h, noise, foreground).cost - penalty(r - h, noise, foreground).cost) / (2 * h),
              penalty(r, noise, foreground).slope, 1e-3)
      << r << " " << foreground;
  EXPECT_NEAR((penalty(r + h, noise, foreground).slope - penalty(r - h, noise, foreground).slope) / (2 * h),
              penalty.second_derivative(r, noise, foreground), 50)
      << r << " " << foreground;
  EXPECT_GE(penalty(r, noise, foreground).curvature, 0);
}

TEST(ColorPenalty, slope_and_second_derivative_are_derivatives_of_the_cost) {
  for (const double foreground : {0.02, 0.1, 0.3, 0.7, 0.98})
    for (double r = -0.02; r < 0.02; r += 0.0007) {
      expect_derivatives(energies::ColorOdds<double>{0.002, 0.1, 0.7}, r, foreground);
      expect_derivatives(energies::ColorPrinted<double>{0.002}, r, foreground);
    }
}

TEST(ColorPenalty, a_colour_that_says_little_or_speaks_for_the_object_leaves_the_depth_penalty) {
  const energies::DepthLogistic<double> depth{0.002, 0.1};
  const energies::ColorOdds<double> odds{0.002, 0.1, 0.7};
  for (const double foreground : {0.13, 0.3, 0.7, 0.9, 0.98})
    for (const double r : {-0.01, -0.001, 0.0, 0.0003, 0.02}) {
      const energies::Curve<double> a = depth(r, 1.0), b = odds(r, 1.0, foreground);
      EXPECT_EQ(a.cost, b.cost);
      EXPECT_EQ(a.slope, b.slope);
      EXPECT_EQ(a.curvature, b.curvature);
      EXPECT_EQ(depth.second_derivative(r, 1.0), odds.second_derivative(r, 1.0, foreground));
    }
}

TEST(ColorPenalty, the_odds_let_go_of_the_backgrounds_colour) {
  const energies::ColorOdds<double> odds{0.002, 0.1, 0.7};
  const double r = 0.004;  // 2 s
  EXPECT_LT(odds(r, 1, 0.02).slope, 0.1 * odds(r, 1, 0.7).slope);
  EXPECT_LT(odds(0.001, 1, 0.02).curvature, 0.15 * odds(0.001, 1, 0.7).curvature);
}

TEST(ColorPenalty, the_printed_form_is_the_sum_of_its_two_terms) {
  const energies::ColorPrinted<double> printed{0.002};
  for (const double r : {-0.004, -0.0002, 0.001, 0.006}) {
    const double on = 1 / std::pow(std::cosh(r / 0.004), 2), f = 0.6;
    const double L = f * on + (r >= 0 ? 0.4 * (1 - on) : 0.0);
    EXPECT_NEAR(printed(r, 1.0, f).cost, -std::log(L + energies::kPosteriorFloor), 1e-12);
  }
  EXPECT_LT(printed(0.003, 1.0, 0.3).slope, 0) << "a background pixel in front pushes away";
  EXPECT_EQ(printed(0.003, 1.0, 0.5).slope, 0) << "and one that may be either does not pull at all";
}

TEST(DistanceTransform, equals_the_brute_force_distance) {
  energies::DistanceGrid grid;
  grid.step = 3, grid.width = 21, grid.height = 17, grid.limit_px = 1e6;
  std::mt19937 random(2);
  std::vector<unsigned char> free(21 * 17);
  for (auto& f : free) f = random() % 30 != 0;
  free[0] = 0;
  energies::DistanceScratch scratch;
  energies::distance_transform(free, &scratch, &grid);
  for (int y = 0; y < 17; ++y)
    for (int x = 0; x < 21; ++x) {
      double best = 1e9;
      for (int v = 0; v < 17; ++v)
        for (int u = 0; u < 21; ++u)
          if (!free[static_cast<std::size_t>(v * 21 + u)]) best = std::min(best, std::hypot(u - x, v - y));
      EXPECT_NEAR(grid.distance_px[static_cast<std::size_t>(y * 21 + x)], 3 * best, 1e-4);
    }
}

TEST(FreeSpace, the_gradient_is_the_slope_of_the_cost_and_pulls_a_point_back) {
  // Half of the image is free: points projected there are charged.
  energies::DistanceGrid grid;
  grid.step = 2, grid.width = 160, grid.height = 120;
  std::vector<unsigned char> free(160 * 120);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x) free[static_cast<std::size_t>(y * 160 + x)] = x > 80 + y / 8;
  energies::DistanceScratch scratch;
  energies::distance_transform(free, &scratch, &grid);
  std::vector<Vec3f> points;
  for (int i = 0; i < 40; ++i)
    points.push_back({0.002f * static_cast<float>(i), 0.001f * static_cast<float>(i % 7), 0.01f});
  tracking::FreeSpaceEnergy energy(&points, &grid, {});
  const optim::State x{{kPose}, kCamera, {}};
  optim::NormalEquations eq;
  eq.reset(6);
  energy.linearize(x, &eq);
  EXPECT_GT(eq.cost, 1);
  EXPECT_EQ(eq.cost, energy.cost(x));
  // The same formula in double, point by point.
  const auto exact = [&](const optim::State& at) {
    double sum = 0;
    for (const Vec3f& p : points) {
      double r;
      Vec3d dr_cam;
      const Vec3d p_cam = inverse(at.T_obj_cam[0]) * p.cast<double>();
      if (energies::free_space_residual(grid.view(), kCamera, 1.0, p_cam, &r, &dr_cam))
        sum += energies::DepthLogistic<double>{0.003, 0}(r, 1.0).cost;
    }
    return sum;
  };
  EXPECT_NEAR(eq.cost, exact(x), 1e-5 * eq.cost);
  for (int j = 0; j < 6; ++j) {
    Eigen::VectorXd d = Eigen::VectorXd::Zero(6);
    const double h = 1e-8;
    d[j] = h;
    const double slope =
        (exact(optim::retract(energy.unknowns(), x, d)) - exact(optim::retract(energy.unknowns(), x, -d))) /
        (2 * h);
    EXPECT_NEAR(slope, eq.gradient[j], 1e-4 * eq.gradient.cwiseAbs().maxCoeff());
  }
  // Moving the object to the left of the image, out of the free half, lowers the cost.
  Rigidd T_cam_obj = inverse(kPose);
  T_cam_obj.t.x -= 0.005;
  EXPECT_LT(energy.cost({{inverse(T_cam_obj)}, kCamera, {}}), eq.cost);
}

}  // namespace
}  // namespace sdftrack
