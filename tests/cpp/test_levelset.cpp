// SPDX-License-Identifier: MIT
// The formulas for voxels: known answers.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

#include "levelset/distance.h"
#include "levelset/evolve.h"
#include "levelset/voxel_ops.h"
#include "volume_fixture.h"

namespace sdftrack {
namespace {

constexpr int kSize = 24;
constexpr double kThird = 6e-8;  // relative; a third is a float whatever the number's type

TEST(Levelset, the_error_function_has_the_stated_error) {
  double worst = 0;
  for (float x = -6; x <= 6; x += 0.00037f)
    worst = std::max(worst, std::abs(static_cast<double>(fast_erf(x)) - std::erf(static_cast<double>(x))));
  EXPECT_LT(worst, 1e-6);
  EXPECT_EQ(fast_erf(1e30f), 1.0f);
  EXPECT_EQ(fast_erf(-0.3f), -fast_erf(0.3f));
}

TEST(Levelset, the_log_ratio_is_odd_bounded_and_the_same_in_double) {
  for (const bool printed : {false, true}) {
    const levelset::EvidenceForm form{printed, 0.005f};
    const double most = printed ? 10 : std::log(19.0);
    // 1 - q is rounded: by 6e-8 of as little as 9e-5 where the printed form is cut.
    const double rounding = printed ? 2e-3 : 2e-5;
    for (double d = 1e-6; d < 0.2; d *= 1.05) {
      const auto near = levelset::log_ratio(static_cast<float>(d), 0.002f, form);
      EXPECT_NEAR(near, -levelset::log_ratio(static_cast<float>(-d), 0.002f, form), rounding) << d;
      const double exact = levelset::log_ratio(d, 0.002, form);
      EXPECT_LE(exact, most + 1e-3);
      EXPECT_NEAR(near, exact, rounding) << d;
    }
    EXPECT_EQ(levelset::log_ratio(0.0f, 0.002f, form), 0.0f);
  }
}

// Voxels one apart on any line have the distances that the upwind difference gives from their neighbours.
TEST(Levelset, the_upwind_difference_is_exact_for_a_plane) {
  for (const Vec3d n : {Vec3d{1, 0, 0}, Vec3d{0.6, 0.8, 0}, Vec3d{0.48, 0.6, 0.64}, Vec3d{0.1, 0.2, 0.97}}) {
    const double h = 0.002, length = norm(n), at = 0.01;
    const auto nearer = [&](double along) { return at - h * along / length; };
    EXPECT_NEAR(levelset::upwind_distance(nearer(n.x), nearer(n.y), nearer(n.z), h), at, kThird * at);
    EXPECT_NEAR(levelset::upwind_distance(nearer(n.z), nearer(n.x), nearer(n.y), h), at, kThird * at);
  }
  EXPECT_NEAR(levelset::upwind_distance(0.01, 1.0, 1.0, 0.002), 0.012,
              1e-12);  // one neighbour alone is known
}

TEST(Levelset, the_upwind_difference_errs_by_the_curvature_near_a_ball) {
  const double h = 0.002, radius = 0.03;
  std::mt19937 random(1);
  std::normal_distribution<double> u;
  for (int k = 0; k < 1000; ++k) {
    Vec3d n{u(random), u(random), u(random)};
    n = (1 / norm(n)) * n;
    const Vec3d p = (radius + 4 * h) * n;
    const auto distance = [&](Vec3d step) {
      return std::min(std::abs(norm(p + step) - radius), std::abs(norm(p - step) - radius));
    };
    const double given =
        levelset::upwind_distance(distance({h, 0, 0}), distance({0, h, 0}), distance({0, 0, h}), h);
    // Between voxels the distance curves by up to h^2 / (2 r); the error is outwards, of that order.
    EXPECT_NEAR(given, 4 * h, h * h / radius);
    EXPECT_GT(given, (1 - kThird) * 4 * h);
  }
}

std::vector<float> evolved(const Volume& v, float most, int steps, bool printed, int threads) {
  const sdf::Grid grid{v.n, v.n, v.n, v.voxel_m, v.origin.cast<double>()};
  std::vector<float> ratio(v.phi);
  for (float& x : ratio) x = -most * std::tanh(x / (2 * v.voxel_m));
  levelset::EvolveOptions options;
  options.printed = printed;
  return levelset::evolve(grid, v.phi.data(), ratio.data(), steps, options, threads);
}

TEST(Levelset, a_plane_without_evidence_stays_where_it_is_up_to_the_faces_of_the_volume) {
  const Volume plane = make_volume(kSize, 0.05, [](Vec3d p) {
    return dot(p, Vec3d{0.48, 0.6, 0.64}) - 0.003;
  });
  for (const bool printed : {false, true}) {
    const std::vector<float> after = evolved(plane, 0, 20, printed, 1);
    double worst = 0;
    for (std::size_t i = 0; i < after.size(); ++i)
      worst = std::max(worst, std::abs(static_cast<double>(after[i] - plane.phi[i])));
    // Voxels; the polynomial's error of 2e-6 at a slope of 1 makes a flux that differs in rounding only.
    EXPECT_LT(worst / plane.voxel_m, 1e-4);
  }
}

// What no frame has seen is inside a ball.
levelset::EvidenceVolume guessed_ball(const sdf::Grid& grid, double radius_m) {
  std::vector<float> prior;
  for (int z = 0; z < grid.nz; ++z)
    for (int y = 0; y < grid.ny; ++y)
      for (int x = 0; x < grid.nx; ++x)
        prior.push_back(static_cast<float>((radius_m - norm(grid.point(x, y, z))) / grid.voxel_m));
  return {grid, prior.data()};
}

std::vector<int> all_blocks(const levelset::EvidenceVolume& evidence) {
  std::vector<int> all(static_cast<std::size_t>(evidence.blocks().count()));
  std::iota(all.begin(), all.end(), 0);
  return all;
}

levelset::EvidenceDistance first_distance(const levelset::EvidenceVolume& evidence, float band_voxels) {
  levelset::EvidenceDistance out(evidence);
  out.update(evidence, all_blocks(evidence), 4, band_voxels, 1, true);
  out.sweep_far(band_voxels);
  out.fill_far(band_voxels, 0, evidence.grid().nz, 1);
  return out;
}

TEST(Levelset, a_surface_that_moves_is_said_to_have_moved_by_as_much_on_the_mean) {
  const sdf::Grid grid{40, 40, 40, 0.002, {-0.039, -0.039, -0.039}};
  const levelset::EvidenceVolume before = guessed_ball(grid, 0.02), after = guessed_ball(grid, 0.0206);
  levelset::EvidenceDistance distance = first_distance(before, 4);
  distance.update(after, all_blocks(after), 4, 4, 1);
  // A voxel's distance is that to a plane through crossings.
  EXPECT_NEAR(distance.change_m(), 0.0006, 0.0003);
  distance.update(after, all_blocks(after), 4, 4, 1);
  EXPECT_EQ(distance.change_m(), 0);
}

TEST(Levelset, a_larger_volume_has_the_same_evidence_at_the_same_places) {
  const sdf::Grid grid{16, 24, 32, 0.002, {-0.01, -0.02, -0.03}};
  const levelset::EvidenceVolume evidence = guessed_ball(grid, 0.02);
  const std::array<int, 3> before{1, 2, 0}, after{3, 1, 2};
  const levelset::EvidenceVolume larger = evidence.padded(before, after);
  const int block = levelset::EvidenceVolume::kBlock;
  EXPECT_EQ(larger.grid().nx, 16 + 4 * block);
  EXPECT_EQ(larger.grid().ny, 24 + 3 * block);
  EXPECT_EQ(larger.grid().nz, 32 + 2 * block);
  for (const auto& [x, y, z] : {std::array{0, 0, 0}, {15, 23, 31}, {7, 12, 3}}) {
    const int X = x + block * before[0], Y = y + block * before[1], Z = z + block * before[2];
    EXPECT_NEAR(norm(larger.grid().point(X, Y, Z) - grid.point(x, y, z)), 0, 1e-12);
    EXPECT_EQ(larger.log_ratio()[larger.grid().index(X, Y, Z)], evidence.log_ratio()[grid.index(x, y, z)]);
  }
}

}  // namespace
}  // namespace sdftrack
