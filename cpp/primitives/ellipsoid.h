// SPDX-License-Identifier: MIT
// The exact distance to an ellipsoid: its nearest point solves one equation in one unknown.
#pragma once

#include "base/vec.h"
#include "primitives/solid_sample.h"

namespace sdftrack {

// The nearest point is q_i = a_i^2 p_i / (t + a_i^2) with F(t) = sum (a_i p_i / (t + a_i^2))^2 - 1 = 0, and
// p - q = t m, m_i = p_i / (t + a_i^2) along the normal: phi = t |m|. F is convex and falls for t > -min
// a_i^2: from the left of the root Newton's steps never overshoot, and near the surface two or three of them
// do.
template <class T>
HD SolidSample<T> ellipsoid_sample(Vec3<T> point, const T (&a)[kMostSizes]) {
  T p[3] = {point.x, point.y, point.z}, a2[3], t = T(-1e30), f = T(-1), slope = T(0);
  int shortest = 0;
  for (int i = 0; i < 3; ++i) {
    a2[i] = a[i] * a[i];
    if (a[i] < a[shortest]) shortest = i;
  }
  // In the plane of symmetry the nearest point would be two: 1e-9 of a radius beside it, it is one.
  const T least = T(1e-9) * a[shortest];
  if (abs(p[shortest]) < least) p[shortest] = p[shortest] < T(0) ? -least : least;
  for (int i = 0; i < 3; ++i) {
    const T x = p[i] / a[i],
            alone = a[i] * abs(p[i]) - a2[i];  // the root if the other two were 0: left of it
    if (alone > t) t = alone;
    f = f + x * x, slope = slope - T(2) * x * x / a2[i];
  }
  const T first = f > T(0) ? T(0) : -f / slope;  // a Newton step from 0: left of the root again
  if (first > t) t = first;
  for (int step = 0; step < 60; ++step) {
    f = T(-1), slope = T(0);
    for (int i = 0; i < 3; ++i) {
      const T inv = T(1) / (t + a2[i]), x = a[i] * p[i] * inv;
      f = f + x * x, slope = slope - T(2) * x * x * inv;
    }
    if (!(f > T(1e-13))) break;
    t = t - f / slope;
  }
  T m[3], n2 = T(0);
  for (int i = 0; i < 3; ++i) m[i] = p[i] / (t + a2[i]), n2 = n2 + m[i] * m[i];
  const T length = sqrt(n2);
  SolidSample<T> s{t * length, {m[0] / length, m[1] / length, m[2] / length}, {}};
  for (int i = 0; i < 3; ++i) s.size[i] = -a[i] * m[i] * m[i] / length;  // -n_i q_i / a_i
  return s;
}

}  // namespace sdftrack
