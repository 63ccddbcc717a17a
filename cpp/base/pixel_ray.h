// SPDX-License-Identifier: MIT
// The ray of a pixel through a lens, for loops and kernels.
#pragma once

#include "base/camera.h"

namespace sdftrack {

// Distorted normalised coordinates to ideal ones by fixed-point iteration; k as in brown_conrady.
HD Vec2d undistorted(const double* k, Vec2d xy) {
  Vec2d ideal = xy;
  for (int i = 0; i < 100; ++i) {
    const Vec2d d = brown_conrady(k, ideal);
    const double ex = xy.x - d.x, ey = xy.y - d.y;
    ideal = {ideal.x + ex, ideal.y + ey};
    if (ex * ex + ey * ey < 1e-24) break;
  }
  return ideal;
}

// A camera's parameters without its image size.
struct LensRays {
  Intrinsics<double> K;
  double k[8];
  bool distorted;

  explicit LensRays(const Camera& camera) : K(camera.K), distorted(camera.distorted()) {
    for (std::size_t i = 0; i < 8; ++i) k[i] = camera.distortion[i];
  }
  // z = 1, distortion removed.
  HD Vec3d at(double u_px, double v_px) const {
    const Vec3d r = ray(K, u_px, v_px);
    if (!distorted) return r;
    const Vec2d xy = undistorted(k, {r.x, r.y});
    return {xy.x, xy.y, 1.0};
  }
};

}  // namespace sdftrack
