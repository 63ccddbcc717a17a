// SPDX-License-Identifier: MIT
#include "tracking/others.h"

#include <algorithm>

namespace sdftrack {

bool on_one_of(const Others& others, Vec3d p_cam, double tolerance_m) {
  for (const SingleObject<float>& other : others) {
    float phi;
    Vec3f unused;
    other.value(p_cam.cast<float>(), &phi, &unused);
    if (static_cast<double>(std::abs(phi)) < tolerance_m) return true;
  }
  return false;
}

double depth_in(const Others& others, const Shape& shape, const Rigidd& T_cam_obj) {
  float deepest = 0;
  const Rigidf T = T_cam_obj.cast<float>();
  for (const SingleObject<float>& other : others)
    for (const Vec3f& p : shape.points) {
      float phi;
      Vec3f unused;
      other.value(T * p, &phi, &unused);
      deepest = std::max(deepest, -phi);
    }
  return static_cast<double>(deepest);
}

}  // namespace sdftrack
