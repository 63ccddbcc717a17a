// SPDX-License-Identifier: MIT
// A ray through the empty part of a shape's field, and its point nearest to the surface.
#pragma once

#include <algorithm>

#include "base/camera.h"
#include "base/rigid.h"
#include "frame/shape.h"

namespace sdftrack::frame {

// In the object's frame; t = depth in front of the eye.
struct ObjectRay {
  Vec3d eye, along;
  Vec3d at(double t) const { return eye + t * along; }
};

inline ObjectRay object_ray(const Intrinsics<double>& K, const Rigidd& T_obj_cam, Vec2d u) {
  return {T_obj_cam.t, T_obj_cam.R * ray(K, u.x, u.y)};
}

struct Passage {
  bool hit;       // whether the ray enters the object
  double t, phi;  // where the ray is nearest to the surface
};

// coarse: shape.coarse().
inline Passage pass(const Shape& shape, const SdfView& coarse, const ObjectRay& ray) {
  constexpr int kMost = 48;
  constexpr double kHitVoxels = 0.3;
  constexpr float kCoarseBeyond = 3;  // coarse voxels from the surface: beyond, the fine field is not needed
  const double voxel = double(shape.sdf.voxel_m);
  const double length = norm(ray.along), reach = 0.5 * shape.diameter_m + 4 * voxel;
  const double middle = -dot(ray.eye, ray.along) / (length * length);
  double t = std::max(1e-3, middle - reach / length);
  const double end = middle + reach / length;
  Passage best{false, middle, 1e9};
  for (int k = 0; k < kMost && t < end; ++k) {
    const Vec3f p = ray.at(t).cast<float>();
    float phi;
    Vec3f unused;
    sample(coarse, p, &phi, &unused);
    if (phi < kCoarseBeyond * coarse.voxel_m) sample(shape.sdf, p, &phi, &unused);
    const auto distance = double(phi);
    if (distance < best.phi) best.t = t, best.phi = distance;
    if (distance < kHitVoxels * voxel) return {true, t, distance};
    t += std::max(distance, voxel) / length;
  }
  return best;
}

}  // namespace sdftrack::frame
