// SPDX-License-Identifier: MIT
// How far a model point lies in free space, where the sensor sees past the object: the formula of one point.
#pragma once

#include "base/camera.h"
#include "base/views.h"

namespace sdftrack::energies {

// View of a DistanceGrid (distance_transform.h), for loops and kernels.
struct DistanceView {
  const float* distance_px;
  int x0, y0, step, width, height;
};

// Bilinear interpolant (px) and its exact derivative by the pixel.
template <class T>
HD void sample(const DistanceView& grid, Vec2<T> u_px, T* distance_px, Vec2<T>* gradient) {
  using S = ScalarOf<T>;
  const T inv = T(S(1) / S(grid.step));
  const AxisSample<T> x = locate((u_px.x - T(S(grid.x0))) * inv, grid.width);
  const AxisSample<T> y = locate((u_px.y - T(S(grid.y0))) * inv, grid.height);
  T d00, d10, d01, d11;
  const IntOf<T> at = y.cell * grid.width + x.cell;
  gather_pair(grid.distance_px, at, &d00, &d10);
  gather_pair(grid.distance_px + grid.width, at, &d01, &d11);
  const T top = d00 + x.fraction * (d10 - d00), bottom = d01 + x.fraction * (d11 - d01);
  *distance_px = top + y.fraction * (bottom - top);
  gradient->x =
      select(x.beyond_vox == T(0), inv * ((d10 - d00) + y.fraction * ((d11 - d01) - (d10 - d00))), T(0));
  gradient->y = select(y.beyond_vox == T(0), inv * (bottom - top), T(0));
}

// r(X) of a surface point at p_cam and its derivative by p_cam (docs/math/depth_tracker.md, eqs. 10 and 11).
// False where the point has no cost.
template <class T>
HD auto free_space_residual(const DistanceView& grid, const Intrinsics<T>& K, T dead_px, Vec3<T> p_cam,
                            T* r_m, Vec3<T>* dr_cam) {
  const T z = p_cam.z, a = K.fx * p_cam.x / z, b = K.fy * p_cam.y / z;  // pixel from the principal point
  T distance;
  Vec2<T> slope;
  sample(grid, Vec2<T>{a + K.cx, b + K.cy}, &distance, &slope);
  const T beyond = distance - dead_px;
  const T f = T(0.5) * (K.fx + K.fy);
  *r_m = z / f * beyond;
  *dr_cam = {slope.x * K.fx / f, slope.y * K.fy / f, (beyond - slope.x * a - slope.y * b) / f};
  return (z > T(1e-3)) & (beyond > T(0));
}

}  // namespace sdftrack::energies
