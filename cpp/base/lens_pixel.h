// SPDX-License-Identifier: MIT
// The pixel of a point through a lens, for loops and kernels; the inverse is in pixel_ray.h.
#pragma once

#include "base/pixel_ray.h"

namespace sdftrack {

// For a point with z > 0; k as in brown_conrady.
HD Vec2d lens_pixel(const Intrinsics<double>& K, const double* k, Vec3d p_cam) {
  const Vec2d xy = brown_conrady(k, {p_cam.x / p_cam.z, p_cam.y / p_cam.z});
  return {K.fx * xy.x + K.cx, K.fy * xy.y + K.cy};
}
HD Vec2d lens_pixel(const LensRays& lens, Vec3d p_cam) {
  return lens.distorted ? lens_pixel(lens.K, lens.k, p_cam) : project(lens.K, p_cam);
}

}  // namespace sdftrack
