// SPDX-License-Identifier: MIT
#include "tracking/visibility.h"

#include <algorithm>
#include <cmath>

namespace sdftrack {

namespace {

constexpr double kFacing = 0.25;        // cosine of the incidence below which a point is not asked
constexpr double kTolerance_m = 0.004;  // least distance that counts as disagreement
constexpr double kTolerancePerNoise = 4;
constexpr double kFinger_m = 0.025;  // nearer than this in front is not clearly another thing
constexpr double kMostGap_m = 0.03;

// Whether the object itself hides p from the camera: march towards the camera through the field.
bool self_hidden(const Shape& shape, Vec3f p, Vec3f normal, Vec3f to_camera) {
  const float voxel = shape.sdf.voxel_m, leave = static_cast<float>(shape.diameter_m);
  const Vec3f start = p + 1.5f * voxel * normal;
  float t = voxel;
  for (int k = 0; k < 24 && t < leave; ++k) {
    float phi;
    Vec3f g;
    sample(shape.sdf, start + t * to_camera, &phi, &g);
    if (phi < 0.1f * voxel) return true;
    t += std::max(phi, voxel);
  }
  return false;
}

}  // namespace

Visibility compare_visible_surface(const DepthFrame& frame, const Camera& camera, const Shape& shape,
                                   const Rigidd& T_cam_obj, double noise_m, int points) {
  Visibility seen;
  const Vec3d eye = inverse(T_cam_obj).t;
  const double tolerance = std::max(kTolerance_m, kTolerancePerNoise * noise_m);
  const std::size_t n = shape.points.size();
  const std::size_t stride = std::max<std::size_t>(1, n / static_cast<std::size_t>(std::max(1, points)));
  int gaps = 0;
  double gap_sum_m = 0;
  for (std::size_t i = 0; i < n; i += stride) {
    const Vec3d p = shape.points[i].cast<double>(), normal = shape.normals[i].cast<double>();
    const Vec3d d = eye - p;
    const Vec3d to_camera = (1 / norm(d)) * d;
    const double facing = dot(normal, to_camera);
    if (facing < kFacing || self_hidden(shape, shape.points[i], shape.normals[i], to_camera.cast<float>()))
      continue;
    ++seen.expected;
    const Vec3d p_cam = T_cam_obj * p;
    const Vec2d u = p_cam.z > 1e-3 ? camera.project_point(p_cam) : Vec2d{-1, -1};
    const int x = static_cast<int>(std::lround(std::clamp(u.x, -1.0, 1e6)));
    const int y = static_cast<int>(std::lround(std::clamp(u.y, -1.0, 1e6)));
    const bool inside = x >= 0 && y >= 0 && x < camera.width && y < camera.height;
    const float z = inside ? frame.depth_m(x, y) : 0.0f;
    const double beyond = (static_cast<double>(z) - p_cam.z) * facing;  // about along the normal
    if (z > 0 && beyond > -kFinger_m) ++gaps, gap_sum_m += std::min(std::abs(beyond), kMostGap_m);
    if (!(z > 0))
      ++seen.missing;
    else if (beyond > tolerance)
      ++seen.farther;
    else if (beyond < -tolerance)
      ++seen.nearer;
    else
      ++seen.agree;
  }
  seen.gap_m = gaps > 0 ? gap_sum_m / gaps : kMostGap_m;
  return seen;
}

}  // namespace sdftrack
