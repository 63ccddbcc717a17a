// SPDX-License-Identifier: MIT
// The exact distance to an ellipsoid: its nearest point solves one equation in one unknown.
#pragma once

#include "sdf/solid_sample.h"

namespace sdftrack::sdf {

// A relative step below this, squared by the next one, is below rounding.
HD double last_step(double) { return 1e-8; }
template <class T>
HD T last_step(T) {
  return T(2e-4f);
}

// Newton's method on Eberly's secular equation F(t) = sum (a_i p_i / (t + a_i^2))^2 - 1 = 0: the nearest
// point is q_i = a_i^2 p_i / (t + a_i^2), and p - q = t m, m_i = p_i / (t + a_i^2), is along the normal, phi
// = t |m|. F is convex and falls for t > -min a_i^2: from the left of the root no step overshoots, and near
// the surface two or three steps suffice.
template <class T>
HD SolidSample<T> ellipsoid_sample(Vec3<T> point, const T (&radii)[kMaxSizes]) {
  T unit = select(radii[1] < radii[0], radii[1], radii[0]);
  unit = select(radii[2] < unit, radii[2], unit);
  // In units of the shortest radius, and in s = t + 1, so that no digits are lost where t + a^2 is tiny.
  const T per_unit = T(1) / unit;
  const T at[3] = {point.x, point.y, point.z};
  T a[3], p[3], above[3], s = T(0), f = T(-1), slope = T(0);
  for (int i = 0; i < 3; ++i) {
    a[i] = radii[i] * per_unit, p[i] = abs(at[i]) * per_unit;
    // In a plane of symmetry two points may be nearest: 1e-9 of a radius away from the plane, only one is.
    p[i] = select((radii[i] > unit) | (p[i] > T(1e-9)), p[i], T(1e-9));
    above[i] = a[i] * a[i] - T(1);
    const T alone = a[i] * p[i] - above[i];  // the root if the other two were 0: left of the true root
    s = select(alone > s, alone, s);
    const T x = p[i] / a[i];
    f = f + x * x, slope = slope + T(2) * x * x / (a[i] * a[i]);
  }
  const T surface =
      select(f > T(0), T(1), T(1) + f / slope);  // a Newton step from t = 0: left of the root again
  s = select(surface > s, surface, s);
  auto going = s > T(0);  // for all lanes; each lane stops independently of the others in its pack
  for (int step = 0; step < 60 && any(going); ++step) {
    f = T(-1), slope = T(0);
    for (int i = 0; i < 3; ++i) {
      const T inv = T(1) / (s + above[i]), x = a[i] * p[i] * inv;
      f = f + x * x, slope = slope + T(2) * x * x * inv;
    }
    const T by = select(going & (f > T(0)), f / slope, T(0));
    s = s + by;
    going = by > last_step(s) * s;
  }
  T m[3], n2 = T(0);
  for (int i = 0; i < 3; ++i) m[i] = p[i] / (s + above[i]), n2 = n2 + m[i] * m[i];
  const T length = sqrt(n2), inv = T(1) / length;
  SolidSample<T> out{(s - T(1)) * length * unit, {}, {}};
  T n[3];
  for (int i = 0; i < 3; ++i) {
    n[i] = m[i] * inv;
    out.size[i] = -a[i] * m[i] * n[i];  // -n_i q_i / a_i
    n[i] = select(at[i] < T(0), -n[i], n[i]);
  }
  out.grad = {n[0], n[1], n[2]};
  return out;
}

}  // namespace sdftrack::sdf
