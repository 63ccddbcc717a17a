// SPDX-License-Identifier: MIT
// The distance to a plane patch: a rectangle without thickness, its normal along z. It has no inside: phi is
// |z| in front of it or behind it and the distance to its rim elsewhere, never below 0. See solids.h.
#pragma once

#include "sdf/solid_sample.h"

namespace sdftrack::sdf {

// `size`: full edges along x and y; the third is not used.
template <class T>
HD SolidSample<T> patch_sample(Vec3<T> p, const T (&size)[kMaxSizes]) {
  const T qx = abs(p.x) - T(0.5) * size[0], qy = abs(p.y) - T(0.5) * size[1];
  const T out_x = select(qx > T(0), qx, T(0)), out_y = select(qy > T(0), qy, T(0));
  const T rim2 = out_x * out_x + out_y * out_y, away = abs(p.z);
  const auto beside = rim2 > T(0);
  const T far = sqrt(select(beside, rim2 + away * away, T(1)));
  const T n_x = select(beside, out_x / far, T(0)), n_y = select(beside, out_y / far, T(0));
  const T n_z = select(beside, away / far, T(1));
  return {select(beside, far, away),
          {select(p.x < T(0), -n_x, n_x), select(p.y < T(0), -n_y, n_y), select(p.z < T(0), -n_z, n_z)},
          {T(-0.5) * n_x, T(-0.5) * n_y, T(0)}};
}

}  // namespace sdftrack::sdf
