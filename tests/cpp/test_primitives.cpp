// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>

#include "primitives/energies.h"
#include "primitives/evidence.h"
#include "primitives/residuals.h"

namespace sdftrack {
namespace {

constexpr double kClearanceTol_m = 2e-6;  // a secant that would gain less is the last

const double kSize[primitives::kPrimitiveKinds][sdf::kMaxSizes] = {
    {0.05, 1, 1}, {0.04, 0.11, 1}, {0.06, 0.13, 1}, {0.10, 0.06, 0.08}, {0.05, 0.08, 0.035}, {0.12, 0.08, 1}};

Vec3d point(int i) {
  const auto part = [&](double a) { return 0.24 * (std::fmod(0.5 + a * i, 1.0) - 0.5); };
  return {part(0.8191725134), part(0.6710436067), part(0.5497004779)};
}

double phi(primitives::PrimitiveKind kind, Vec3d p, const double (&size)[sdf::kMaxSizes]) {
  return primitives::exact_sample(kind, p, size).phi_m;
}

TEST(Solids, a_kind_by_its_number_is_the_kind_by_its_traits) {
  using Cone = primitives::SolidTraits<primitives::PrimitiveKind::kCone>;
  constexpr auto kCone = primitives::PrimitiveKind::kCone;
  static_assert(primitives::size_count(kCone) == 2 && primitives::has_apex(kCone));
  static_assert(!primitives::has_inside(primitives::PrimitiveKind::kPlane));
  const auto& size = kSize[static_cast<int>(kCone)];
  for (int i = 1; i < 20; ++i) {
    const sdf::SolidSample<double> own = Cone::sample(point(i), size),
                                   by_number = primitives::exact_sample(kCone, point(i), size);
    EXPECT_EQ(own.phi_m, by_number.phi_m);
    EXPECT_EQ(own.grad.x, by_number.grad.x);
  }
  for (int k = 0; k < primitives::kPrimitiveKinds; ++k) {
    const auto kind = static_cast<primitives::PrimitiveKind>(k);
    EXPECT_STREQ(primitives::visit_solid(kind, [](auto solid) { return solid.kName; }),
                 primitives::facts(kind).name);
    EXPECT_EQ(primitives::is_round(kind), primitives::free_count(kind) == 7) << "all but the turn about z";
  }
}

template <primitives::PrimitiveKind kKind>
void expect_the_least_distance(const double (&size)[sdf::kMaxSizes], double deepest_m) {
  for (int i = 1; i < 200; ++i) {
    const Vec3d from{0, 0, -0.8}, way = (1 / 0.8) * (1.5 * point(i) - from);
    const double a = i % 5 == 0 ? 0.85 : 0.5, b = i % 7 == 0 ? 0.75 : 1.1;  // some do not reach the middle
    if (a > b) continue;
    const auto at = [&](double depth) { return phi(kKind, from + depth * way, size); };
    double low = a, high = b;  // by thirds: phi is convex
    while (high - low > 1e-7) {
      const double third = (high - low) / 3;
      if (at(low + third) < at(high - third))
        high -= third;
      else
        low += third;
    }
    const double least = at(0.5 * (low + high));
    const auto own = primitives::SolidTraits<kKind>::least_along(from, way, a, b, size);
    if (least < -deepest_m) continue;  // through the middle, where phi has a kink
    EXPECT_NEAR(own.m, least, kClearanceTol_m) << i;
    EXPECT_EQ(own.m, own.low.s.phi_m);
  }
}

TEST(Solids, the_clearance_of_balls_and_ellipsoids_is_the_least_distance_along_the_ray) {
  constexpr auto kSphere = primitives::PrimitiveKind::kSphere,
                 kEllipsoid = primitives::PrimitiveKind::kEllipsoid;
  expect_the_least_distance<kSphere>(kSize[static_cast<int>(kSphere)], 1);
  expect_the_least_distance<kEllipsoid>(kSize[static_cast<int>(kEllipsoid)], 0.007);
  expect_the_least_distance<kEllipsoid>({0.15, 0.12, 0.003}, 0.0006);
}

// A ball of 50 mm, 0.5 m ahead, whose readings err by 2 mm; those of a block of pixels by the same.
double alike_px2(int block_px) {
  constexpr double kPixel = 0.001, kRadius = 0.05, kAhead = 0.5;
  primitives::PrimitiveView view;
  view.along_rays = true;
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 120; ++x) {
      const Vec3d ray{kPixel * (x - 59.5), kPixel * (y - 59.5), 1};
      const double a = dot(ray, ray), b = kAhead, c = kAhead * kAhead - kRadius * kRadius;
      const double hit = (b - std::sqrt(b * b - a * c)) / a;
      const double error = point(1 + x / block_px + 1000 * (y / block_px)).x / 0.12;  // evenly in -1 .. 1
      view.points.push_back((hit + 0.002 * error) * ray), view.pixels.push_back({x, y});
    }
  view.pack();
  primitives::PrimitiveFit fit;
  fit.kind = primitives::PrimitiveKind::kSphere, fit.scale_m = 0.001, fit.found = true;
  fit.x.T_obj_cam = {{Mat3d::identity(), {0, 0, -kAhead}}}, fit.x.log_size = {std::log(kRadius)};
  return primitives::correlated_px2(fit, view, {});
}

TEST(Primitives, readings_that_err_alike_are_known_by_the_area_that_does) {
  EXPECT_LT(alike_px2(1), 3);
  // Of blocks of n the correlation falls as 1 - l / n: over rings, pi n^2 / 3. There are 100 to 400 of them,
  // and few lags: within a third.
  for (const int n : {6, 12}) {
    const double area = 3.14159265358979 * n * n / 3;
    EXPECT_NEAR(alike_px2(n), area, area / 3) << n;
  }
}

// A patch of 120 x 80 mm, face on, 0.5 m before the camera.
primitives::PrimitiveField patch_ahead() {
  return {primitives::PrimitiveKind::kPlane,
          primitives::Scaling::kExact,
          {Mat3d{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}, {0, 0, 0.5}},
          {0.12, 0.08, 1}};
}

TEST(Primitives, a_ray_clears_a_patch_by_its_way_to_the_rim) {
  const double slope = 0.07 / 0.5;                     // meets the plane 10 mm beside the patch
  const double square = std::sqrt(1 + slope * slope);  // the way across the ray is shorter
  primitives::SolidResidual r;
  primitives::clearance(patch_ahead(), {{slope, 0, 1}, 0.1, 0.9, 0.001, primitives::Sight::kOn}, &r);
  EXPECT_NEAR(r.m, 0.01 / square, 1e-12);
  EXPECT_NEAR(r.J[6], -0.06 / square, 1e-12);  // by the logarithm of the width: the rim is at its half
  EXPECT_NEAR(r.J[7], 0, 1e-12);
  primitives::clearance(patch_ahead(), {{0, 0, 1}, 0.1, 0.9, 0.001, primitives::Sight::kOn}, &r);
  EXPECT_NEAR(r.m, -0.04, 1e-12);  // through the middle: the nearer sides are 40 mm off
  primitives::clearance(patch_ahead(), {{0, 0, 1}, 0.1, 0.3, 0.001, primitives::Sight::kOn}, &r);
  EXPECT_NEAR(r.m, 0.2, 1e-12);  // it ends 0.2 m before the patch
  primitives::clearance(patch_ahead(), {{0, 0.08, 1}, 0.1, 0.9, 0.001, primitives::Sight::kOn}, &r);
  EXPECT_NEAR(r.m, 0, 1e-12);  // over the rim to the last bit: it has a derivative still
  EXPECT_NEAR(r.J[7], -0.04 / std::sqrt(1 + 0.08 * 0.08), 1e-9);
}

TEST(Primitives, readings_before_and_behind_a_patch_are_as_far_from_it) {
  primitives::SolidResidual before, behind;
  primitives::ray_residual(patch_ahead(), {0.01, 0.02, 0.49}, &before);
  primitives::ray_residual(patch_ahead(), {0.01, 0.02, 0.51}, &behind);
  EXPECT_NEAR(before.m, 0.01, 1e-12);
  EXPECT_NEAR(behind.m, -0.01, 1e-12);
  for (int j = 0; j < 3; ++j) EXPECT_NEAR(before.J[j], behind.J[j], 1e-12);
}

}  // namespace
}  // namespace sdftrack
