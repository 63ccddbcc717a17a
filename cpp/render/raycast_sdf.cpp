// SPDX-License-Identifier: MIT
#include "render/raycast_sdf.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/parallel.h"
#include "render/pixel_box.h"

namespace sdftrack::render {

namespace {

constexpr double kMinStepVoxels = 0.1;  // where the ray grazes the surface; thinner slivers may be missed
constexpr double kRootTolerance_m = 1e-8;
constexpr int kTile = 8;        // pixels; rays of a tile that misses as a whole are not traced
constexpr double kSlope = 1.5;  // an interpolated distance changes by less than this per metre

struct Ray {
  Vec3d origin, direction;  // object frame; direction has z = 1 in the camera's, so t is the depth

  Vec3d at(double t) const { return origin + t * direction; }
};

struct Span {
  double near, far;
};

Span clip(const Ray& ray, Vec3d low, Vec3d high) {
  Span span{0, std::numeric_limits<double>::infinity()};
  const auto axis = [&](double o, double d, double l, double h) {
    if (d == 0) {
      if (o < l || o > h) span.far = -1;
      return;
    }
    double t0 = (l - o) / d, t1 = (h - o) / d;
    if (t0 > t1) std::swap(t0, t1);
    span.near = std::max(span.near, t0);
    span.far = std::min(span.far, t1);
  };
  axis(ray.origin.x, ray.direction.x, low.x, high.x);
  axis(ray.origin.y, ray.direction.y, low.y, high.y);
  axis(ray.origin.z, ray.direction.z, low.z, high.z);
  return span;
}

// A step along a ray. Far from the camera it may be less than what tells one depth from the next.
double moved(double t, double step) {
  return std::max(t + step, std::nextafter(t, std::numeric_limits<double>::infinity()));
}

double phi_at(const SdfView& sdf, const Ray& ray, double t) {
  double phi;
  Vec3d gradient;
  sample(sdf, ray.at(t), &phi, &gradient);
  return phi;
}

// phi(a) > 0 >= phi(b): the Illinois form of regula falsi never leaves the bracket.
double root(const SdfView& sdf, const Ray& ray, double a, double phi_a, double b, double phi_b) {
  const double tolerance = kRootTolerance_m / norm(ray.direction);
  for (int i = 0; i < 60 && b - a > tolerance; ++i) {
    const double t = std::clamp((a * phi_b - b * phi_a) / (phi_b - phi_a), a, b);
    const double phi = phi_at(sdf, ray, t);
    if (std::abs(phi) < kRootTolerance_m) return t;
    if (phi > 0) {
      a = t, phi_a = phi, phi_b *= 0.5;
    } else {
      b = t, phi_b = phi, phi_a *= 0.5;
    }
  }
  return 0.5 * (a + b);
}

// Depth of the first place where the ray goes in, 0 when it does not. A ray that starts inside (the camera is
// in the object, or the object is cut by its box) first has to come out.
double first_zero(const SdfView& sdf, const Ray& ray, Span span) {
  const double per_m = 1 / norm(ray.direction), min_step = kMinStepVoxels * static_cast<double>(sdf.voxel_m);
  double t = span.near, phi = phi_at(sdf, ray, t);
  while (t < span.far) {
    const double next = std::min(span.far, moved(t, std::max(std::abs(phi), min_step) * per_m));
    const double phi_next = phi_at(sdf, ray, next);
    if (phi > 0 && phi_next <= 0) return root(sdf, ray, t, phi, next, phi_next);
    t = next, phi = phi_next;
  }
  return 0;
}

struct Box {
  Vec3d low, high;
};

// Pixels from (u0, v0) to before (u1, v1).
struct Tile {
  int u0, v0, u1, v1;
};

// Whether every ray of a tile misses the shape. The rays lie in a cone around the middle one; spheres that
// contain the cone's cross-section are moved along it as long as they are outside.
bool misses(const Tile& tile, const SdfView& sdf, const Camera& camera, const Rigidd& T_obj_cam,
            const Box& box, double far) {
  const auto direction = [&](double u, double v) { return T_obj_cam.R * camera.pixel_ray(u, v); };
  const Ray middle{T_obj_cam.t, direction(0.5 * (tile.u0 + tile.u1 - 1), 0.5 * (tile.v0 + tile.v1 - 1))};
  double cone = 0;  // m per metre of depth
  for (const int u : {tile.u0, tile.u1 - 1})
    for (const int v : {tile.v0, tile.v1 - 1})
      cone = std::max(cone, norm(direction(u, v) - middle.direction));
  cone *= 1.1;  // a lens bends the rays between the corners
  const Vec3d margin{cone * far, cone * far, cone * far};
  const Span span = clip(middle, box.low - margin, box.high + margin);
  const double speed = kSlope * (norm(middle.direction) + cone);
  const double min_step = kMinStepVoxels * static_cast<double>(sdf.voxel_m) / speed;
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

SdfImage raycast_sdf(const SdfView& sdf, const Camera& camera, const Rigidd& T_cam_obj, int threads) {
  const std::size_t pixels = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  SdfImage out{std::vector<float>(pixels), std::vector<float>(3 * pixels)};
  const Vec3d low = sdf.origin_obj.cast<double>();
  const Vec3d high = low + static_cast<double>(sdf.voxel_m) * Vec3d{static_cast<double>(sdf.nx - 1),
                                                                    static_cast<double>(sdf.ny - 1),
                                                                    static_cast<double>(sdf.nz - 1)};
  const PixelBox px = pixel_box(camera, T_cam_obj, low, high);
  if (px.empty()) return out;

  const Rigidd T_obj_cam = inverse(T_cam_obj);
  const Box box{low, high};
  const double far = farthest(T_cam_obj, box);
  const auto trace = [&](int v, int left, int right) {
    for (int u = left; u < right; ++u) {
      const Ray ray{T_obj_cam.t, T_obj_cam.R * camera.pixel_ray(u, v)};
      const Span span = clip(ray, low, high);
      if (!(span.near < span.far)) continue;
      const double depth = first_zero(sdf, ray, span);
      if (!(depth > 0)) continue;
      double phi;
      Vec3d g;
      sample(sdf, ray.at(depth), &phi, &g);
      const Vec3d n = (1 / std::max(norm(g), 1e-12)) * (T_cam_obj.R * g);
      const std::size_t i =
          static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(u);
      out.depth_m[i] = static_cast<float>(depth);
      out.normals_cam[3 * i] = static_cast<float>(n.x);
      out.normals_cam[3 * i + 1] = static_cast<float>(n.y);
      out.normals_cam[3 * i + 2] = static_cast<float>(n.z);
    }
  };
  const auto rows = [&](std::size_t chunk) {
    const int begin = px.y0 + static_cast<int>(chunk) * kTile, end = std::min(px.y1, begin + kTile);
    for (int left = px.x0; left < px.x1; left += kTile) {
      const int right = std::min(px.x1, left + kTile);
      if (misses({left, begin, right, end}, sdf, camera, T_obj_cam, box, far)) continue;
      for (int v = begin; v < end; ++v) trace(v, left, right);
    }
  };
  parallel_for(static_cast<std::size_t>((px.y1 - px.y0 + kTile - 1) / kTile), threads, rows);
  return out;
}

}  // namespace sdftrack::render
