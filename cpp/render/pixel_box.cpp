// SPDX-License-Identifier: MIT
#include "render/pixel_box.h"

#include <algorithm>
#include <cmath>

#include "base/to_int.h"

namespace sdftrack::render {

namespace {

struct Bounds {
  double x0 = 1e300, y0 = 1e300, x1 = -1e300, y1 = -1e300;

  void add(double x, double y) {
    x0 = std::min(x0, x), y0 = std::min(y0, y), x1 = std::max(x1, x), y1 = std::max(y1, y);
  }
};

constexpr int kBorderSteps = 32;

// The image's border in ideal coordinates (x / z, y / z), where a lens model is known to hold.
Bounds ideal_image(const Camera& camera) {
  Bounds b;
  for (int i = 0; i <= kBorderSteps; ++i) {
    const double s = double(i) / kBorderSteps;
    const double u = s * camera.width - 0.5, v = s * camera.height - 0.5;
    for (const Vec3d& r : {camera.pixel_ray(u, -0.5), camera.pixel_ray(u, camera.height - 0.5),
                           camera.pixel_ray(-0.5, v), camera.pixel_ray(camera.width - 0.5, v)})
      b.add(r.x, r.y);
  }
  return b;
}

// Pixels of an ideal rectangle: its border goes through the lens.
Bounds through_lens(const Camera& camera, const Bounds& ideal) {
  Bounds px;
  for (int i = 0; i <= kBorderSteps; ++i) {
    const double s = double(i) / kBorderSteps;
    const double x = ideal.x0 + s * (ideal.x1 - ideal.x0), y = ideal.y0 + s * (ideal.y1 - ideal.y0);
    for (const Vec3d& r :
         {Vec3d{x, ideal.y0, 1}, Vec3d{x, ideal.y1, 1}, Vec3d{ideal.x0, y, 1}, Vec3d{ideal.x1, y, 1}}) {
      const Vec2d u = camera.project_point(r);
      px.add(u.x, u.y);
    }
  }
  return px;
}

}  // namespace

PixelBox pixel_box(const Camera& camera, const Rigidd& T_cam_obj, Vec3d low_obj, Vec3d high_obj) {
  Bounds ideal;
  int in_front = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3d p =
        T_cam_obj * Vec3d{corner & 1 ? high_obj.x : low_obj.x, corner & 2 ? high_obj.y : low_obj.y,
                          corner & 4 ? high_obj.z : low_obj.z};
    if (!(p.z > 0)) continue;
    ++in_front;
    ideal.add(p.x / p.z, p.y / p.z);
  }
  if (in_front == 0) return {0, 0, 0, 0};
  if (in_front < 8) return {0, 0, camera.width, camera.height};  // the camera may be inside the box
  if (camera.distorted()) {
    const Bounds image = ideal_image(camera);
    ideal = {std::max(ideal.x0, image.x0), std::max(ideal.y0, image.y0), std::min(ideal.x1, image.x1),
             std::min(ideal.y1, image.y1)};
    if (ideal.x0 > ideal.x1 || ideal.y0 > ideal.y1) return {0, 0, 0, 0};
  }
  const Bounds px = through_lens(camera, ideal);
  constexpr double kMargin = 2;  // the lens bends the border between the points of through_lens a little
  const auto clip = [](double v, int n) { return to_int(std::clamp(v, 0.0, double(n))); };
  return {clip(std::floor(px.x0 - kMargin), camera.width), clip(std::floor(px.y0 - kMargin), camera.height),
          clip(std::ceil(px.x1 + kMargin) + 1, camera.width),
          clip(std::ceil(px.y1 + kMargin) + 1, camera.height)};
}

}  // namespace sdftrack::render
