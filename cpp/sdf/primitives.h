// SPDX-License-Identifier: MIT
// Exact signed distances (m, negative inside) of simple solids, centred at the origin, axes along z.
#pragma once

#include <algorithm>
#include <cmath>

#include "base/vec.h"

namespace sdftrack {

inline double sphere_distance(Vec3d p, double radius) { return norm(p) - radius; }

// `size`: full edges.
inline double box_distance(Vec3d p, Vec3d size) {
  const Vec3d q{std::abs(p.x) - size.x / 2, std::abs(p.y) - size.y / 2, std::abs(p.z) - size.z / 2};
  const Vec3d out{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
  return norm(out) + std::min(0.0, std::max({q.x, q.y, q.z}));
}

inline double cylinder_distance(Vec3d p, double radius, double height) {
  const double r = std::hypot(p.x, p.y) - radius, z = std::abs(p.z) - height / 2;
  return std::hypot(std::max(r, 0.0), std::max(z, 0.0)) + std::min(0.0, std::max(r, z));
}

// Apex at +height / 2, base of `radius` at -height / 2.
inline double cone_distance(Vec3d p, double radius, double height) {
  const double r = std::hypot(p.x, p.y), z = p.z + height / 2;  // base at z = 0
  const double on_base = std::hypot(std::max(r - radius, 0.0), z);
  const double s =
      std::clamp(((radius - r) * radius + z * height) / (radius * radius + height * height), 0.0, 1.0);
  const double on_side = std::hypot(r - radius * (1 - s), z - height * s);
  const bool inside = z >= 0 && r * height + z * radius <= radius * height;
  return inside ? -std::min(std::abs(z), on_side) : std::min(on_base, on_side);
}

// Nearest point of the ellipsoid by Newton's method on Eberly's secular equation
// F(t) = sum (a_i p_i / (t + a_i^2))^2 - 1 = 0, convex and falling for t > -min a_i^2: from the left of the
// root the steps never overshoot.
inline double ellipsoid_distance(Vec3d point, Vec3d radii) {
  double a[3] = {radii.x, radii.y, radii.z}, p[3] = {std::abs(point.x), std::abs(point.y), std::abs(point.z)};
  for (int pass = 0; pass < 2; ++pass)  // a[2] the shortest
    for (int i = 0; i < 2; ++i)
      if (a[i] < a[i + 1]) std::swap(a[i], a[i + 1]), std::swap(p[i], p[i + 1]);
  const double unit = a[2];  // from here on in units of the shortest axis
  for (int i = 0; i < 3; ++i) a[i] /= unit, p[i] /= unit;
  p[2] = std::max(p[2], 1e-9);  // in the plane of symmetry the nearest point would be two; 1e-9 of a radius
  // In s = t + 1, so that no digits are lost where t + a2^2 is tiny. The last term alone is 1 at s = p2.
  double s = p[2];
  for (int i = 0; i < 100; ++i) {
    double f = -1, slope = 0;
    for (int k = 0; k < 3; ++k) {
      const double r = 1 / (s + (a[k] * a[k] - 1)), x = a[k] * p[k] * r;
      f += x * x, slope -= 2 * x * x * r;
    }
    if (!(f > 0)) break;
    const double step = -f / slope;
    s += step;
    if (step <= 1e-15 * s) break;
  }
  double d2 = 0, level = -1;
  for (int k = 0; k < 3; ++k) {
    const double d = p[k] * (s - 1) / (s + (a[k] * a[k] - 1));  // p - nearest point
    d2 += d * d, level += (p[k] / a[k]) * (p[k] / a[k]);
  }
  return (level < 0 ? -unit : unit) * std::sqrt(d2);
}

}  // namespace sdftrack
