// SPDX-License-Identifier: MIT
// Exact signed distances (m, negative inside) of simple solids, centred at the origin, axes along z, from
// which volumes are made.
#pragma once

#include "sdf/solid_ellipsoid.h"
#include "sdf/solids.h"

namespace sdftrack::sdf {

inline double sphere_distance(Vec3d p, double radius) { return sphere_sample(p, radius).phi_m; }

// `size`: full edges.
inline double box_distance(Vec3d p, Vec3d size) {
  const double edges[kMaxSizes] = {size.x, size.y, size.z};
  return box_sample(p, edges).phi_m;
}

inline double cylinder_distance(Vec3d p, double radius, double height) {
  return cylinder_sample(p, radius, height).phi_m;
}

// Apex at +height / 2, base of `radius` at -height / 2.
inline double cone_distance(Vec3d p, double radius, double height) {
  return cone_sample(p, radius, height).phi_m;
}

inline double ellipsoid_distance(Vec3d p, Vec3d radii) {
  const double lengths[kMaxSizes] = {radii.x, radii.y, radii.z};
  return ellipsoid_sample(p, lengths).phi_m;
}

}  // namespace sdftrack::sdf
