// SPDX-License-Identifier: MIT
// One triangle: its closest point and where a ray meets it.
#pragma once

#include "base/vec.h"

namespace sdftrack::sdf {

struct Triangle {
  Vec3d a, b, c;
};

// Closest point of the triangle to p, by the Voronoi regions of its corners and edges (Ericson, Real-Time
// Collision Detection, 2005, section 5.1.5). For a triangle without area: the closest point of its edges.
HD Vec3d closest_point(const Triangle& t, Vec3d p) {
  const Vec3d ab = t.b - t.a, ac = t.c - t.a, ap = p - t.a;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return t.a;
  const Vec3d bp = p - t.b;
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return t.b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3) return t.a + (d1 / (d1 - d3)) * ab;
  const Vec3d cp = p - t.c;
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return t.c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return t.a + (d2 / (d2 - d6)) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
    return t.b + ((d4 - d3) / ((d4 - d3) + (d5 - d6))) * (t.c - t.b);
  const double s = 1 / (va + vb + vc);
  return t.a + (vb * s) * ab + (vc * s) * ac;
}

struct RayHit {
  double t = 0;                   // the hit is origin + t * direction
  double wa = 0, wb = 0, wc = 0;  // barycentric weights
};

// Where the ray origin + t * direction, t > 0, meets the triangle, seen from either side. The three edge
// volumes are antisymmetric in their two corners, bit by bit, so a ray cannot slip through a shared edge.
HD bool intersect(const Triangle& t, Vec3d origin, Vec3d direction, RayHit* hit) {
  const Vec3d a = t.a - origin, b = t.b - origin, c = t.c - origin;
  const double u = dot(direction, cross(b, c)), v = dot(direction, cross(c, a)),
               w = dot(direction, cross(a, b));
  if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return false;
  const double volume = u + v + w;
  if (volume == 0) return false;  // seen edge-on, or without area
  const double wa = u / volume, wb = v / volume, wc = w / volume;
  const Vec3d p = wa * a + wb * b + wc * c;
  const double along = dot(p, direction) / dot(direction, direction);
  if (!(along > 0)) return false;
  *hit = {along, wa, wb, wc};
  return true;
}

}  // namespace sdftrack::sdf
