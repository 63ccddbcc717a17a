// SPDX-License-Identifier: MIT
// Exact signed distances of solids, centred at mid-height, axis along z, a cone's apex at +z: phi (m,
// negative inside), its gradient, and its derivative with respect to every length. For phi = n . (p - q), q
// the nearest point of the surface and n the normal there, a length that moves the surface at q by dq changes
// phi by -n . dq. docs/math/primitives.md derives them. T: a lane type (base/lane.h), or a number with
// derivatives.
#pragma once

#include "sdf/solid_sample.h"

namespace sdftrack::sdf {

// A plane patch, a rectangle without thickness, its normal along z: phi is |z| in front of it or behind it
// and the distance to its rim elsewhere, never below 0. `size`: full edges along x and y; the third is not
// used.
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

template <class T>
HD SolidSample<T> sphere_sample(Vec3<T> p, T radius) {
  const T r = norm(p);
  const auto off = r > T(1e-12);
  const T inv = T(1) / select(off, r, T(1));
  const Vec3<T> n{p.x * inv, p.y * inv, select(off, p.z * inv, T(1))};
  return {r - radius, n, {T(-1), T(0), T(0)}};
}

// `size`: full edges.
template <class T>
HD SolidSample<T> box_sample(Vec3<T> p, const T (&size)[kMaxSizes]) {
  const T at[3] = {p.x, p.y, p.z};
  T q[3], out[3];
  for (int i = 0; i < 3; ++i) {
    q[i] = abs(at[i]) - T(0.5) * size[i];
    out[i] = select(q[i] > T(0), q[i], T(0));
  }
  const auto second = q[1] > q[0];
  const T most = select(second, q[1], q[0]);
  const auto third = q[2] > most;
  const T deepest = select(third, q[2], most);
  const T face[3] = {select(third, T(0), select(second, T(0), T(1))),
                     select(third, T(0), select(second, T(1), T(0))), select(third, T(1), T(0))};
  const auto outside = deepest > T(0);
  const T far = sqrt(select(outside, out[0] * out[0] + out[1] * out[1] + out[2] * out[2], T(1)));
  T n[3];
  for (int i = 0; i < 3; ++i) n[i] = select(outside, out[i] / far, face[i]);
  SolidSample<T> s{select(outside, far, deepest), {}, {T(-0.5) * n[0], T(-0.5) * n[1], T(-0.5) * n[2]}};
  for (int i = 0; i < 3; ++i) n[i] = select(at[i] < T(0), -n[i], n[i]);
  s.grad = {n[0], n[1], n[2]};
  return s;
}

// A sample in the half plane (r, z) of a round body, rotated to the direction of p.
template <class T>
HD Vec3<T> turned(Vec3<T> p, T r, T n_r, T n_z) {
  const auto off = r > T(1e-12);
  const T inv = n_r / select(off, r, T(1));
  return {select(off, inv * p.x, n_r), select(off, inv * p.y, T(0)), n_z};
}
template <class T>
HD T axis_distance(Vec3<T> p) {
  const T r2 = p.x * p.x + p.y * p.y;
  return sqrt(select(r2 > T(1e-24), r2, T(0)));
}

template <class T>
HD SolidSample<T> cylinder_sample(Vec3<T> p, T radius, T height) {
  const T r = axis_distance(p), a = r - radius, b = abs(p.z) - T(0.5) * height;
  const auto rim = (a > T(0)) & (b > T(0));
  const auto side = a > b;
  const T to_rim = sqrt(select(rim, a * a + b * b, T(1)));
  const T phi = select(rim, to_rim, select(side, a, b));
  const T n_r = select(rim, a / to_rim, select(side, T(1), T(0)));
  const T n_z = select(rim, b / to_rim, select(side, T(0), T(1)));
  return {phi, turned(p, r, n_r, select(p.z < T(0), -n_z, n_z)), {-n_r, T(-0.5) * n_z, T(0)}};
}

// Nearest part: the base, its rim (s = 0), the side (0 < s < 1) or the apex (s = 1); s runs up the side.
template <class T>
HD SolidSample<T> cone_sample(Vec3<T> p, T radius, T height) {
  const T r = axis_distance(p), z = p.z + T(0.5) * height;  // base at z = 0
  const T slant2 = radius * radius + height * height, slant = sqrt(slant2);
  const T to_side = ((r - radius) * height + z * radius) / slant;
  const T up_side = ((radius - r) * radius + z * height) / slant2;
  const auto inside = (to_side < T(0)) & (z > T(0));
  const auto base = (inside & (z < -to_side)) | ((z <= T(0)) & (r < radius));
  const auto side = inside | ((up_side > T(0)) & (up_side < T(1)));
  // Otherwise a corner: the rim or the apex.
  const auto apex = up_side > T(0);
  const T d_r = select(apex, r, r - radius), d_z = select(apex, z - height, z);
  const T to_corner = sqrt(d_r * d_r + d_z * d_z);
  const auto off = to_corner > T(1e-12);
  const T inv = T(1) / select(off, to_corner, T(1));
  const T corner_z = select(off, d_z * inv, select(apex, T(1), T(-1)));
  const T n_r = select(base, T(0), select(side, height / slant, d_r * inv));
  const T n_z = select(base, T(-1), select(side, radius / slant, corner_z));
  const T s = select(base, T(0), select(side, up_side, select(apex, T(1), T(0))));
  const T phi = select(base, -z, select(side, to_side, to_corner));
  return {phi, turned(p, r, n_r, n_z), {-n_r * (T(1) - s), -n_z * (s - T(0.5)), T(0)}};
}

}  // namespace sdftrack::sdf
