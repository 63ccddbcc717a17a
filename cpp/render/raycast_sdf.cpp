// SPDX-License-Identifier: MIT
#include "render/raycast_sdf.h"

#include <algorithm>

#include "base/interrupt.h"
#include "base/parallel.h"
#include "render/pixel_box.h"
#include "render/sdf_ray.h"

namespace sdftrack::render {

namespace {

constexpr int kTile = 8;        // pixels; the rays of a tile are not traced if all of them miss
constexpr double kSlope = 1.5;  // an interpolated distance changes by less than this per metre

// Pixels from (u0, v0) to before (u1, v1).
struct Tile {
  int u0, v0, u1, v1;
};

// Whether every ray of a tile misses the shape. The rays lie in a cone around the middle one; spheres that
// contain the cone's cross-section are moved along it as long as they are outside.
bool misses(const Tile& tile, const SdfRays& rays, double far) {
  const SdfView& sdf = rays.sdf;
  const Ray middle = rays.ray(0.5 * (tile.u0 + tile.u1 - 1), 0.5 * (tile.v0 + tile.v1 - 1));
  double cone = 0;  // m per metre of depth
  for (const int u : {tile.u0, tile.u1 - 1})
    for (const int v : {tile.v0, tile.v1 - 1})
      cone = std::max(cone, norm(rays.ray(u, v).direction - middle.direction));
  cone *= 1.1;  // a lens bends the rays between the corners
  const Vec3d margin{cone * far, cone * far, cone * far};
  const Span span = clip(middle, {rays.box.low - margin, rays.box.high + margin});
  const double speed = kSlope * (norm(middle.direction) + cone);
  const double min_step = kMinStepVoxels * double(sdf.voxel_m) / speed;
  for (double t = span.near; t < span.far;) {
    const double clearance = phi_at(sdf, middle, t) - kSlope * cone * t;
    if (!(clearance > 0)) return false;
    t = moved(t, std::max(clearance / speed, min_step));
  }
  return true;
}

// Depth of the corner of a box that is farthest from the camera.
double farthest(const Rigidd& T_cam_obj, const Box& box) {
  double far = 0;
  for (const double x : {box.low.x, box.high.x})
    for (const double y : {box.low.y, box.high.y})
      for (const double z : {box.low.z, box.high.z}) far = std::max(far, (T_cam_obj * Vec3d{x, y, z}).z);
  return far;
}

}  // namespace

SdfImage::SdfImage(const Camera& camera) {
  const std::size_t pixels = std::size_t(camera.width) * camera.height;
  depth_m.resize(pixels), normals_cam.resize(3 * pixels);
}

SdfImage raycast_sdf(const SdfView& sdf, const Camera& camera, const Rigidd& T_cam_obj, int threads) {
  SdfImage out(camera);
  const SdfRays rays(sdf, camera, T_cam_obj);
  const PixelBox px = pixel_box(camera, T_cam_obj, rays.box.low, rays.box.high);
  if (px.empty()) return out;

  const double far = farthest(T_cam_obj, rays.box);
  const auto trace = [&](int v, int left, int right) {
    for (int u = left; u < right; ++u) {
      const Hit hit = rays.trace(u, v);
      const std::size_t i = std::size_t(v) * camera.width + u;
      out.depth_m[i] = hit.depth_m;
      out.normals_cam[3 * i] = hit.normal_cam.x;
      out.normals_cam[3 * i + 1] = hit.normal_cam.y;
      out.normals_cam[3 * i + 2] = hit.normal_cam.z;
    }
  };
  const auto rows = [&](std::size_t chunk) {
    check_interrupt();
    const int begin = px.y0 + int(chunk) * kTile, end = std::min(px.y1, begin + kTile);
    for (int left = px.x0; left < px.x1; left += kTile) {
      const int right = std::min(px.x1, left + kTile);
      if (misses({left, begin, right, end}, rays, far)) continue;
      for (int v = begin; v < end; ++v) trace(v, left, right);
    }
  };
  parallel_for((px.y1 - px.y0 + kTile - 1) / kTile, threads, rows);
  return out;
}

}  // namespace sdftrack::render
