// SPDX-License-Identifier: MIT
#include "base/camera.h"

#include "base/lens_pixel.h"

namespace sdftrack {

Vec2d distort(const Distortion& k, Vec2d xy) { return brown_conrady(k.data(), xy); }

Vec2d undistort(const Distortion& k, Vec2d xy) { return undistorted(k.data(), xy); }

bool Camera::distorted() const {
  for (double k : distortion)
    if (k != 0) return true;
  return false;
}

Vec2d Camera::project_point(Vec3d p_cam) const { return lens_pixel(K, distortion.data(), p_cam); }

Vec3d Camera::pixel_ray(double u_px, double v_px) const { return LensRays(*this).at(u_px, v_px); }

std::vector<float> ray_table(const Camera& camera) {
  std::vector<float> table;
  table.reserve(2 * std::size_t(camera.width) * camera.height);
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const Vec3d r = camera.pixel_ray(u, v);
      table.push_back(float(r.x));
      table.push_back(float(r.y));
    }
  return table;
}

}  // namespace sdftrack
