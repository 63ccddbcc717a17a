// SPDX-License-Identifier: MIT
// The worked example of docs/add_an_energy.md: a penalty that the library does not have, from its formula to
// its finite differences. The note quotes this file.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "energies/term.h"

namespace sdftrack {
namespace {

using namespace energies;

// [penalty]
// The density of Cauchy as a cost, log(1 + (r / s)^2) / 2: quadratic near 0, hardly growing far away.
template <class T>
struct DepthCauchy {
  T scale_m;

  HD Curve<T> operator()(T residual_m, T per_noise) const {
    const T per_s = (T(1) / scale_m) * per_noise, q = residual_m * per_s;
    const T weight = per_s * per_s / (T(1) + q * q);
    return {T(0.5) * std::log1p(q * q), weight * residual_m, weight};
  }
};
// [penalty]

// [slope]
TEST(DepthCauchy, its_slope_is_the_derivative_of_its_cost) {
  const DepthCauchy<double> penalty{0.002};
  const double h = 1e-7;
  for (const double r : {-0.03, -0.002, -1e-5, 0.0, 4e-4, 0.01}) {
    const double slope = (penalty(r + h, 1).cost - penalty(r - h, 1).cost) / (2 * h);
    EXPECT_NEAR(penalty(r, 1).slope, slope, 1e-4) << "at " << r;  // slopes are up to 250 / m
    EXPECT_GE(penalty(r, 1).curvature, 0);
  }
}
// [slope]

// A ball in a volume of its own, and a few pixels that look at it.
struct Scene {
  static constexpr int kVoxels = 24;
  std::vector<float> phi;
  std::vector<double> u{310, 320, 331, 322}, v{240, 229, 243, 250}, depth{0.452, 0.449, 0.455, 0.461};
  std::vector<double> noise{1, 1, 1, 1}, hit{depth}, trial{depth}, gain{1, 1, 1, 1};

  Scene() {
    for (int z = 0; z < kVoxels; ++z)
      for (int y = 0; y < kVoxels; ++y)
        for (int x = 0; x < kVoxels; ++x)
          phi.push_back(static_cast<float>(0.01 * std::hypot(x - 11.5, y - 11.5, z - 11.5) - 0.05));
  }
  SdfView sdf() const { return {phi.data(), kVoxels, kVoxels, kVoxels, 0.01F, {-0.115F, -0.115F, -0.115F}}; }
  PixelsView<double> pixels() {
    return {4, u.data(), v.data(), depth.data(), noise.data(), hit.data(), trial.data(), gain.data()};
  }
};

// [gradient]
using CauchyTerm = Term<SingleObject<double>, DepthCauchy<double>>;

TEST(DepthCauchy, the_gradient_of_the_energy_is_the_slope_of_its_cost) {
  Scene scene;
  const Rigidd start{rotation_exp(Vec3d{0.1, -0.2, 0.3}), {0.004, -0.003, -0.5}};
  const auto term_at = [&](const Rigidd& T_obj_cam) {
    return CauchyTerm{
        {scene.sdf(), T_obj_cam}, {0.002}, {500, 500, 320, 240}, scene.pixels(), Residual::kPoint, true, 1};
  };
  const auto cost_at = [&](const Rigidd& T_obj_cam) {
    double cost = 0;
    for (int i = 0; i < 4; ++i) cost += term_at(T_obj_cam).cost(i);
    return cost;
  };

  Sums<double, 6> sums;
  for (int i = 0; i < 4; ++i) sums.add(term_at(start).linearize(i));

  const double h = 1e-7;  // m and rad: far below a voxel, far above rounding
  for (int j = 0; j < 6; ++j) {
    double step[6] = {};
    step[j] = h;
    const Rigidd plus = increment(Vec3d{step[0], step[1], step[2]}, Vec3d{step[3], step[4], step[5]});
    const double slope = (cost_at(plus * start) - cost_at(inverse(plus) * start)) / (2 * h);
    EXPECT_NEAR(sums.gradient[j], slope, 1e-5 * (1 + std::abs(slope))) << "unknown " << j;
  }
  EXPECT_GT(std::abs(sums.gradient[2]), 1);  // the start is not the minimum, or there were nothing to see
}
// [gradient]

}  // namespace
}  // namespace sdftrack
