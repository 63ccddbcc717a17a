// SPDX-License-Identifier: MIT
#include "base/camera.h"

namespace sdftrack {

Vec2d distort(const Distortion& k, Vec2d xy) { return brown_conrady(k.data(), xy); }

Vec2d undistort(const Distortion& k, Vec2d xy) {
  Vec2d ideal = xy;
  for (int i = 0; i < 100; ++i) {
    const Vec2d d = distort(k, ideal);
    const double ex = xy.x - d.x, ey = xy.y - d.y;
    ideal = {ideal.x + ex, ideal.y + ey};
    if (ex * ex + ey * ey < 1e-24) break;
  }
  return ideal;
}

bool Camera::distorted() const {
  for (double k : distortion)
    if (k != 0) return true;
  return false;
}

Vec2d Camera::project_point(Vec3d p_cam) const {
  const Vec2d xy = distort(distortion, {p_cam.x / p_cam.z, p_cam.y / p_cam.z});
  return {K.fx * xy.x + K.cx, K.fy * xy.y + K.cy};
}

Vec3d Camera::pixel_ray(double u_px, double v_px) const {
  const Vec3d r = ray(K, u_px, v_px);
  if (!distorted()) return r;
  const Vec2d xy = undistort(distortion, {r.x, r.y});
  return {xy.x, xy.y, 1.0};
}

std::vector<float> ray_table(const Camera& camera) {
  std::vector<float> table;
  table.reserve(2 * static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const Vec3d r = camera.pixel_ray(u, v);
      table.push_back(static_cast<float>(r.x));
      table.push_back(static_cast<float>(r.y));
    }
  return table;
}

}  // namespace sdftrack
