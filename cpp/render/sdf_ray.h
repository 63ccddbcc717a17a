// SPDX-License-Identifier: MIT
// A ray into a distance volume: sphere tracing, then the root of the interpolant along it. For CPU and GPU.
#pragma once

#include <cmath>
#include <limits>

#include "base/order.h"
#include "base/pixel_ray.h"
#include "base/rigid.h"
#include "base/views.h"

namespace sdftrack::render {

constexpr double kMinStepVoxels = 0.1;  // where the ray grazes the surface; thinner slivers may be missed
constexpr double kRootTolerance_m = 1e-8;
constexpr double kEndless = std::numeric_limits<double>::infinity();

struct Ray {
  Vec3d origin, direction;  // object frame; direction has z = 1 in the camera's, so t is the depth

  HD Vec3d at(double t) const { return origin + t * direction; }
};

struct Span {
  double near, far;

  // Clips the ray to a box along one axis.
  HD void clip(double o, double d, double low, double high) {
    if (d == 0) {
      if (o < low || o > high) far = -1;
      return;
    }
    const double a = (low - o) / d, b = (high - o) / d;
    near = larger(near, a > b ? b : a);
    far = smaller(far, a > b ? a : b);
  }
};

struct Box {
  Vec3d low, high;
};

// The centres of a volume's first and last voxel.
HD Box box_of(const SdfView& sdf) {
  const Vec3d low = sdf.origin_obj.cast<double>();
  const Vec3d size{double(sdf.nx - 1), double(sdf.ny - 1), double(sdf.nz - 1)};
  return {low, low + double(sdf.voxel_m) * size};
}

HD Span clip(const Ray& ray, const Box& box) {
  Span span{0, kEndless};
  span.clip(ray.origin.x, ray.direction.x, box.low.x, box.high.x);
  span.clip(ray.origin.y, ray.direction.y, box.low.y, box.high.y);
  span.clip(ray.origin.z, ray.direction.z, box.low.z, box.high.z);
  return span;
}

// A step along a ray. Far from the camera `step` may be less than the spacing of doubles.
HD double moved(double t, double step) { return larger(t + step, std::nextafter(t, kEndless)); }

HD double phi_at(const SdfView& sdf, const Ray& ray, double t) {
  double phi;
  Vec3d gradient;
  sample(sdf, ray.at(t), &phi, &gradient);
  return phi;
}

// phi(a) > 0 >= phi(b): the Illinois form of regula falsi never leaves the bracket.
HD double root(const SdfView& sdf, const Ray& ray, double a, double phi_a, double b, double phi_b) {
  const double tolerance = kRootTolerance_m / norm(ray.direction);
  for (int i = 0; i < 60 && b - a > tolerance; ++i) {
    const double t = smaller(larger((a * phi_b - b * phi_a) / (phi_b - phi_a), a), b);
    const double phi = phi_at(sdf, ray, t);
    if (abs(phi) < kRootTolerance_m) return t;
    if (phi > 0) {
      a = t, phi_a = phi, phi_b *= 0.5;
    } else {
      b = t, phi_b = phi, phi_a *= 0.5;
    }
  }
  return 0.5 * (a + b);
}

// Depth of the first point where the ray enters the object, 0 if it does not. A ray that starts inside (the
// camera is in the object, or the box cuts the object) must leave it first.
HD double first_zero(const SdfView& sdf, const Ray& ray, Span span) {
  const double per_m = 1 / norm(ray.direction), min_step = kMinStepVoxels * double(sdf.voxel_m);
  double t = span.near, phi = phi_at(sdf, ray, t);
  while (t < span.far) {
    const double next = smaller(span.far, moved(t, larger(abs(phi), min_step) * per_m));
    const double phi_next = phi_at(sdf, ray, next);
    if (phi > 0 && phi_next <= 0) return root(sdf, ray, t, phi, next, phi_next);
    t = next, phi = phi_next;
  }
  return 0;
}

struct Hit {
  float depth_m = 0;  // z; 0: the ray misses
  Vec3f normal_cam{0, 0, 0};
};

// A volume in front of a camera.
struct SdfRays {
  SdfView sdf;
  LensRays lens;
  Rigidd T_cam_obj, T_obj_cam;
  Box box;

  SdfRays(const SdfView& sdf_, const Camera& camera, const Rigidd& T_cam_obj_)
      : sdf(sdf_), lens(camera), T_cam_obj(T_cam_obj_), T_obj_cam(inverse(T_cam_obj_)), box(box_of(sdf_)) {}

  HD Ray ray(double u_px, double v_px) const { return {T_obj_cam.t, T_obj_cam.R * lens.at(u_px, v_px)}; }

  HD Hit trace(int u, int v) const {
    const Ray r = ray(u, v);
    const Span span = clip(r, box);
    if (!(span.near < span.far)) return {};
    const double depth = first_zero(sdf, r, span);
    if (!(depth > 0)) return {};
    double phi;
    Vec3d g;
    sample(sdf, r.at(depth), &phi, &g);
    const Vec3d n = (1 / larger(norm(g), 1e-12)) * (T_cam_obj.R * g);
    return {float(depth), n.cast<float>()};
  }
};

}  // namespace sdftrack::render
