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

constexpr int kRowsPerChunk = 8;
constexpr double kMinStepVoxels = 0.1;  // where the ray grazes the surface; thinner slivers may be missed
constexpr double kRootTolerance_m = 1e-8;

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
    const double next = std::min(span.far, t + std::max(std::abs(phi), min_step) * per_m);
    const double phi_next = phi_at(sdf, ray, next);
    if (phi > 0 && phi_next <= 0) return root(sdf, ray, t, phi, next, phi_next);
    t = next, phi = phi_next;
  }
  return 0;
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
  const auto rows = [&](std::size_t chunk) {
    const int begin = px.y0 + static_cast<int>(chunk) * kRowsPerChunk,
              end = std::min(px.y1, begin + kRowsPerChunk);
    for (int v = begin; v < end; ++v)
      for (int u = px.x0; u < px.x1; ++u) {
        const Ray ray{T_obj_cam.t, T_obj_cam.R * camera.pixel_ray(u, v)};
        const Span span = clip(ray, low, high);
        if (!(span.near < span.far)) continue;
        const double depth = first_zero(sdf, ray, span);
        if (!(depth > 0)) continue;
        double phi;
        Vec3d g;
        sample(sdf, ray.at(depth), &phi, &g);
        const Vec3d n = (1 / std::max(norm(g), 1e-12)) * (T_cam_obj.R * g);
        const std::size_t i = static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width) +
                              static_cast<std::size_t>(u);
        out.depth_m[i] = static_cast<float>(depth);
        out.normals_cam[3 * i] = static_cast<float>(n.x);
        out.normals_cam[3 * i + 1] = static_cast<float>(n.y);
        out.normals_cam[3 * i + 2] = static_cast<float>(n.z);
      }
  };
  parallel_for(static_cast<std::size_t>((px.y1 - px.y0 + kRowsPerChunk - 1) / kRowsPerChunk), threads, rows);
  return out;
}

}  // namespace sdftrack::render
