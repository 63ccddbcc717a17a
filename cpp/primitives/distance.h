// SPDX-License-Identifier: MIT
// Exact signed distances of solids whose lengths are unknowns: phi (m, negative inside), its gradient by the
// point and its derivative by every length. For phi = n . (p - q), q the nearest point of the surface and n
// the normal there, a length that moves the surface at q by dq changes phi by -n . dq.
// docs/math/primitives.md derives them.
#pragma once

#include "base/vec.h"
#include "primitives/ellipsoid.h"
#include "primitives/kind.h"
#include "primitives/solid_sample.h"

namespace sdftrack {

template <class T>
HD SolidSample<T> sphere_sample(Vec3<T> p, T radius) {
  const T r = norm(p);
  const Vec3<T> n = r > T(1e-12) ? (T(1) / r) * p : Vec3<T>{T(0), T(0), T(1)};
  return {r - radius, n, {T(-1), T(0), T(0)}};
}

// `size`: full edges.
template <class T>
HD SolidSample<T> box_sample(Vec3<T> p, const T (&size)[kMostSizes]) {
  const T at[3] = {p.x, p.y, p.z};
  T q[3], out[3], n[3] = {T(0), T(0), T(0)};
  int deepest = 0;
  for (int i = 0; i < 3; ++i) {
    q[i] = abs(at[i]) - T(0.5) * size[i];
    out[i] = q[i] > T(0) ? q[i] : T(0);
    if (q[i] > q[deepest]) deepest = i;
  }
  T phi = q[deepest];
  if (phi > T(0)) {
    phi = sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
    for (int i = 0; i < 3; ++i) n[i] = out[i] / phi;
  } else {
    n[deepest] = T(1);
  }
  SolidSample<T> s{phi, {T(0), T(0), T(0)}, {T(-0.5) * n[0], T(-0.5) * n[1], T(-0.5) * n[2]}};
  for (int i = 0; i < 3; ++i) n[i] = at[i] < T(0) ? -n[i] : n[i];
  s.grad = {n[0], n[1], n[2]};
  return s;
}

// The half plane (r, z) of a round body, turned to where p is.
template <class T>
HD Vec3<T> turned(Vec3<T> p, T r, T n_r, T n_z) {
  if (r > T(1e-12)) return {n_r * p.x / r, n_r * p.y / r, n_z};
  return {n_r, T(0), n_z};
}
template <class T>
HD T axis_distance(Vec3<T> p) {
  const T r2 = p.x * p.x + p.y * p.y;
  return r2 > T(1e-24) ? sqrt(r2) : T(0);
}

template <class T>
HD SolidSample<T> cylinder_sample(Vec3<T> p, T radius, T height) {
  const T r = axis_distance(p), a = r - radius, b = abs(p.z) - T(0.5) * height;
  T phi, n_r = T(0), n_z = T(0);
  if (a > T(0) && b > T(0)) {
    phi = sqrt(a * a + b * b), n_r = a / phi, n_z = b / phi;
  } else if (a > b) {
    phi = a, n_r = T(1);
  } else {
    phi = b, n_z = T(1);
  }
  return {phi, turned(p, r, n_r, p.z < T(0) ? -n_z : n_z), {-n_r, T(-0.5) * n_z, T(0)}};
}

// Nearest is the base, its rim (s = 0), the side (0 < s < 1) or the apex (s = 1); s runs up the side.
template <class T>
HD SolidSample<T> cone_sample(Vec3<T> p, T radius, T height) {
  const T r = axis_distance(p), z = p.z + T(0.5) * height;  // base at z = 0
  const T slant2 = radius * radius + height * height, slant = sqrt(slant2);
  const T to_side = ((r - radius) * height + z * radius) / slant;
  T s = ((radius - r) * radius + z * height) / slant2;
  T phi, n_r, n_z;
  if (to_side < T(0) && z > T(0)) {  // inside
    if (z < -to_side)
      phi = -z, n_r = T(0), n_z = T(-1), s = T(0);
    else
      phi = to_side, n_r = height / slant, n_z = radius / slant;
  } else if (z < T(0) && r < radius) {
    phi = -z, n_r = T(0), n_z = T(-1), s = T(0);
  } else if (s > T(0) && s < T(1)) {
    phi = to_side, n_r = height / slant, n_z = radius / slant;
  } else {
    const bool rim = !(s > T(0));
    s = rim ? T(0) : T(1);
    const T d_r = rim ? r - radius : r, d_z = rim ? z : z - height;
    phi = sqrt(d_r * d_r + d_z * d_z);
    const bool far = phi > T(1e-12);
    n_r = far ? d_r / phi : T(0), n_z = far ? d_z / phi : (rim ? T(-1) : T(1));
  }
  return {phi, turned(p, r, n_r, n_z), {-n_r * (T(1) - s), -n_z * (s - T(0.5)), T(0)}};
}

template <class T>
HD SolidSample<T> exact_sample(PrimitiveKind kind, Vec3<T> p, const T (&size)[kMostSizes]) {
  switch (kind) {
    case PrimitiveKind::kSphere:
      return sphere_sample(p, size[0]);
    case PrimitiveKind::kCylinder:
      return cylinder_sample(p, size[0], size[1]);
    case PrimitiveKind::kCone:
      return cone_sample(p, size[0], size[1]);
    case PrimitiveKind::kBox:
      return box_sample(p, size);
    case PrimitiveKind::kEllipsoid:
      break;
  }
  return ellipsoid_sample(p, size);
}

}  // namespace sdftrack
