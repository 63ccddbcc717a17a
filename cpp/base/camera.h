// SPDX-License-Identifier: MIT
// Pinhole camera: pixel centres at integers, x right, y down, z forward; depth is z, not ray length.
#pragma once

#include <array>
#include <vector>

#include "base/vec.h"

namespace sdftrack {

template <class T>
struct Intrinsics {
  T fx, fy, cx, cy;

  template <class U>
  HD Intrinsics<U> cast() const {
    return {static_cast<U>(fx), static_cast<U>(fy), static_cast<U>(cx), static_cast<U>(cy)};
  }
};

// The ray of a pixel, scaled to z = 1: p_cam = depth * ray.
template <class T>
HD Vec3<T> ray(const Intrinsics<T>& K, T u_px, T v_px) {
  return {(u_px - K.cx) / K.fx, (v_px - K.cy) / K.fy, T(1)};
}
template <class T>
HD Vec2<T> project(const Intrinsics<T>& K, Vec3<T> p_cam) {
  return {K.fx * p_cam.x / p_cam.z + K.cx, K.fy * p_cam.y / p_cam.z + K.cy};
}

// Brown-Conrady with the rational part, OpenCV's order: k1 k2 p1 p2 k3 k4 k5 k6; unused ones are 0.
using Distortion = std::array<double, 8>;

// Ideal normalised coordinates (x/z, y/z) to distorted ones; k as above.
template <class T>
HD Vec2<T> brown_conrady(const T* k, Vec2<T> xy) {
  const T x = xy.x, y = xy.y, r2 = x * x + y * y;
  const T radial =
      (T(1) + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))) / (T(1) + r2 * (k[5] + r2 * (k[6] + r2 * k[7])));
  return {x * radial + T(2) * k[2] * x * y + k[3] * (r2 + T(2) * x * x),
          y * radial + k[2] * (r2 + T(2) * y * y) + T(2) * k[3] * x * y};
}

// Distortion in double, and its inverse (fixed-point iteration).
Vec2d distort(const Distortion& k, Vec2d xy);
Vec2d undistort(const Distortion& k, Vec2d xy);

struct Camera {
  Intrinsics<double> K{};
  int width = 0, height = 0;
  Distortion distortion{};

  bool distorted() const;
  Vec2d project_point(Vec3d p_cam) const;           // pixel of a point with z > 0
  Vec3d pixel_ray(double u_px, double v_px) const;  // z = 1, distortion removed
};

// The rays' x and y for every pixel, interleaved, row-major. Computed once per camera that has distortion.
std::vector<float> ray_table(const Camera& camera);

}  // namespace sdftrack
