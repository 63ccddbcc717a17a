// SPDX-License-Identifier: MIT
#include "tracking/trust/neighbors.h"

#include <algorithm>
#include <limits>

namespace sdftrack::tracking {

bool on_one_of(const Neighbors& others, Vec3d p_cam, double tolerance_m) {
  for (const energies::SingleObject<float>& other : others) {
    float phi;
    Vec3f unused;
    other.value(p_cam.cast<float>(), &phi, &unused);
    if (double(std::abs(phi)) < tolerance_m) return true;
  }
  return false;
}

double gap_between(const energies::SingleObject<float>& other, const frame::Shape& shape,
                   const Rigidd& T_cam_obj) {
  float least = std::numeric_limits<float>::max();
  const Rigidf T = T_cam_obj.cast<float>();
  for (const Vec3f& p : shape.points) {
    float phi;
    Vec3f unused;
    other.value(T * p, &phi, &unused);
    least = std::min(least, phi);
  }
  return double(least);
}

double depth_in(const Neighbors& others, const frame::Shape& shape, const Rigidd& T_cam_obj) {
  double deepest = 0;
  for (const energies::SingleObject<float>& other : others)
    deepest = std::max(deepest, -gap_between(other, shape, T_cam_obj));
  return deepest;
}

bool middle_in(const energies::SingleObject<float>& other, const frame::Shape& shape,
               const Rigidd& T_cam_obj) {
  constexpr float kMost = 0.5;  // of its own depth: the surfaces of two in one place are not in each other
  float phi;
  Vec3f unused;
  other.value(T_cam_obj.cast<float>() * shape.middle, &phi, &unused);
  return phi < -kMost * shape.depth_m;
}

bool stands_in(const Neighbors& others, const frame::Shape& shape, const Rigidd& T_cam_obj) {
  constexpr double kMost = 0.3;  // of the thinnest extent
  const Vec3d& h = shape.half_box_m;
  return std::any_of(others.begin(), others.end(),
                     [&](const auto& other) { return middle_in(other, shape, T_cam_obj); }) ||
         depth_in(others, shape, T_cam_obj) > kMost * 2 * std::min({h.x, h.y, h.z});
}

}  // namespace sdftrack::tracking
