// SPDX-License-Identifier: MIT
// The loops over points give the numbers that a slow formula gives.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "point_fixture.h"

namespace sdftrack {
namespace {

using Scene = PointScene;
const Rigidd& kPose = kPointPose;
const Intrinsics<float>& kCamera = kPointCamera;

// A convex body hides a point exactly where the surface turns away from the camera.
TEST(PointOps, a_sight_is_what_geometry_says) {
  const Scene scene;
  const Vec3d eye = inverse(kPose).t;
  frame::Sights sights;
  frame::point_ops_for(used_isa()).sights(scene.sight(), 0, &sights);
  int k = 0;
  for (std::size_t i = 0; i < frame::kPointsAtOnce; ++i) {
    const Vec3d p = scene.points[i].cast<double>(), d = eye - p;
    const double facing = dot(scene.normals[i].cast<double>(), d) / norm(d);
    if (facing < frame::kSeenFacing) continue;
    ASSERT_LT(k, sights.count);
    EXPECT_NEAR(sights.facing[k], facing, 1e-5);
    EXPECT_NEAR(sights.z_m[k], (kPose * p).z, 1e-6);
    ++k;
  }
  EXPECT_EQ(k, sights.count);
}

TEST(PointOps, a_bearing_is_the_angle_about_the_middle) {
  const Scene scene;
  const Vec2f middle = project(kCamera, kPose.t.cast<float>());
  frame::Bearings seen;
  frame::point_ops_for(used_isa()).bearings(scene.bearing(), 0, &seen);
  for (int k = 0; k < seen.count; ++k) {
    const Vec2f u =
        project(kCamera, (kPose * scene.points[static_cast<std::size_t>(k)].cast<double>()).cast<float>());
    const double turn = std::atan2(u.y - middle.y, u.x - middle.x) / (2 * std::numbers::pi) + 0.5;
    EXPECT_NEAR(seen.turn[k], turn, 2e-4);
    EXPECT_NEAR(seen.radius_px[k], std::hypot(u.x - middle.x, u.y - middle.y), 1e-3);
  }
}

}  // namespace
}  // namespace sdftrack
