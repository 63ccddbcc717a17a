// SPDX-License-Identifier: MIT
// Points and readings of a box at a pose, for the loops over points.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "frame/point_ops.h"
#include "volume_fixture.h"

namespace sdftrack {

inline const Volume kPointBox = make_volume(40, 0.1, [](Vec3d p) {
  return box_distance(p, {0.05, 0.03, 0.04});
});
inline const Rigidd kPointPose{rotation_exp(Vec3d{0.5, -0.4, 0.3}), {0.01, -0.02, 0.5}};  // T_cam_obj
inline const Intrinsics<float> kPointCamera{525, 520, 160, 120};

// Points on the box's faces with their normals, readings about the pose, an image of depths and a distance
// grid.
struct PointScene {
  std::vector<Vec3f> points, normals, readings;
  std::vector<float> depths, distances;

  explicit PointScene(int count = 301) {
    std::mt19937 random(11);
    std::uniform_real_distribution<float> u(-1, 1), wide(-0.09f, 0.09f);
    for (int i = 0; i < count; ++i) {
      const float side = i % 2 ? 1.0f : -1.0f, a = u(random), b = u(random);
      const int axis = i % 3;
      points.push_back(axis == 0   ? Vec3f{side * 0.05f, a * 0.03f, b * 0.04f}
                       : axis == 1 ? Vec3f{a * 0.05f, side * 0.03f, b * 0.04f}
                                   : Vec3f{a * 0.05f, b * 0.03f, side * 0.04f});
      normals.push_back({axis == 0 ? side : 0, axis == 1 ? side : 0, axis == 2 ? side : 0});
      readings.push_back((kPointPose * Vec3d{wide(random), wide(random), wide(random)}).cast<float>());
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
    const Rigidf T_cam_obj = kPointPose.cast<float>(), T_obj_cam = inverse(kPointPose).cast<float>();
    const energies::SingleObject<float> field{kPointBox.view(), T_obj_cam};
    const energies::DepthLogistic<float> penalty{0.01f, 0.1f, energies::Curvature::kIrls, 0.02f};
    return {{field, penalty, view(readings, 1), false, 0},
            {field, penalty, view(readings, 2), true, 0.003f},
            {T_cam_obj,
             kPointCamera,
             penalty,
             {depths.data(), 0, 0, 4, 80, 60},
             view(points, 2),
             view(normals, 2)},
            {T_cam_obj,
             T_obj_cam,
             kPointCamera,
             {0.005f, 0},
             {distances.data(), 0, 0, 4, 80, 60},
             view(points, 1),
             0.7f}};
  }
  frame::SightTerm<float> sight() const {
    return {kPointBox.view(),
            kPointBox.view(),
            kPointPose.cast<float>(),
            inverse(kPointPose).t.cast<float>(),
            0.15f,
            view(points, 1),
            view(normals, 1)};
  }
  frame::BearingTerm<float> bearing() const {
    return {kPointPose.cast<float>(), kPointCamera, project(kPointCamera, kPointPose.t.cast<float>()),
            view(points, 1)};
  }
};

// Poses about that one.
inline std::vector<Rigidf> poses_near(int count) {
  std::vector<Rigidf> out;
  for (int k = 0; k < count; ++k) {
    const Rigidd moved{rotation_exp(Vec3d{0.1 * (k % 3), -0.07 * (k % 5), 0.03 * k}),
                       {0.002 * k, 0, -0.003 * (k % 4)}};
    out.push_back(inverse(kPointPose * moved).cast<float>());
  }
  return out;
}

}  // namespace sdftrack
