// SPDX-License-Identifier: MIT
// The loops over points: the same bits on every instruction set, and the numbers that a slow formula gives.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <random>

#include "frame/point_ops.h"
#include "volume_fixture.h"

namespace sdftrack {
namespace {

const Volume kBox = make_volume(40, 0.1, [](Vec3d p) { return box_distance(p, {0.05, 0.03, 0.04}); });
const Rigidd kPose{rotation_exp(Vec3d{0.5, -0.4, 0.3}), {0.01, -0.02, 0.5}};  // T_cam_obj
const Intrinsics<float> kCamera{525, 520, 160, 120};

// Points on the box's faces with their normals, readings about the pose, an image of depths and a distance
// grid.
struct Scene {
  std::vector<Vec3f> points, normals, readings;
  std::vector<float> depths, distances;

  Scene() {
    std::mt19937 random(11);
    std::uniform_real_distribution<float> u(-1, 1), wide(-0.09f, 0.09f);
    for (int i = 0; i < 301; ++i) {
      const float side = i % 2 ? 1.0f : -1.0f, a = u(random), b = u(random);
      const int axis = i % 3;
      points.push_back(axis == 0   ? Vec3f{side * 0.05f, a * 0.03f, b * 0.04f}
                       : axis == 1 ? Vec3f{a * 0.05f, side * 0.03f, b * 0.04f}
                                   : Vec3f{a * 0.05f, b * 0.03f, side * 0.04f});
      normals.push_back({axis == 0 ? side : 0, axis == 1 ? side : 0, axis == 2 ? side : 0});
      readings.push_back((kPose * Vec3d{wide(random), wide(random), wide(random)}).cast<float>());
    }
    for (int i = 0; i < 80 * 60; ++i) {
      depths.push_back(i % 7 == 0 ? 0.0f : 0.5f + 0.1f * u(random));
      distances.push_back(8 * std::abs(u(random)));
    }
  }

  static frame::PointsView view(const std::vector<Vec3f>& list, int stride) {
    return {list.data(), static_cast<int>(list.size()), stride};
  }
  frame::QuickTerms terms() const {
    const Rigidf T_cam_obj = kPose.cast<float>(), T_obj_cam = inverse(kPose).cast<float>();
    const energies::SingleObject<float> field{kBox.view(), T_obj_cam};
    const energies::DepthLogistic<float> penalty{0.01f, 0.1f, energies::Curvature::kIrls, 0.02f};
    return {
        {field, penalty, view(readings, 1), false, 0},
        {field, penalty, view(readings, 2), true, 0.003f},
        {T_cam_obj, kCamera, penalty, {depths.data(), 0, 0, 4, 80, 60}, view(points, 2), view(normals, 2)},
        {T_cam_obj,
         T_obj_cam,
         kCamera,
         {0.005f, 0},
         {distances.data(), 0, 0, 4, 80, 60},
         view(points, 1),
         0.7f}};
  }
  frame::SightTerm<float> sight() const {
    return {kBox.view(), kBox.view(),     kPose.cast<float>(), inverse(kPose).t.cast<float>(),
            0.15f,       view(points, 1), view(normals, 1)};
  }
  frame::BearingTerm<float> bearing() const {
    return {kPose.cast<float>(), kCamera, project(kCamera, kPose.t.cast<float>()), view(points, 1)};
  }
};

template <class T>
void expect_same_bytes(const T& a, const T& b, Isa isa) {
  EXPECT_EQ(std::memcmp(&a, &b, sizeof a), 0) << isa_name(isa);
}

TEST(PointOps, every_instruction_set_gives_the_same_bits) {
  const Scene scene;
  const frame::PointOps& slow = frame::PointOps::baseline;
  for (const Isa isa : supported_isas()) {
    const frame::PointOps& fast = frame::point_ops_for(isa);
    expect_same_bytes(fast.linearize(scene.terms()), slow.linearize(scene.terms()), isa);
    expect_same_bytes(fast.cost(scene.terms()), slow.cost(scene.terms()), isa);
    for (int first = 0; first < 301; first += frame::kPointsAtOnce) {
      frame::Sights a, b;
      fast.sights(scene.sight(), first, &a), slow.sights(scene.sight(), first, &b);
      frame::Bearings c, d;
      fast.bearings(scene.bearing(), first, &c), slow.bearings(scene.bearing(), first, &d);
      ASSERT_EQ(a.count, b.count);
      for (int k = 0; k < a.count; ++k) {
        EXPECT_EQ(a.facing[k], b.facing[k]);
        EXPECT_EQ(a.z_m[k], b.z_m[k]);
      }
      ASSERT_EQ(c.count, d.count);
      for (int k = 0; k < c.count; ++k) {
        EXPECT_EQ(c.turn[k], d.turn[k]);
        EXPECT_EQ(c.radius_px[k], d.radius_px[k]);
      }
    }
  }
}

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
