// SPDX-License-Identifier: MIT
// The nearest point of a volume's zero set.
#pragma once

#include "base/views.h"

namespace sdftrack {

// One step down the gradient onto phi = 0.
inline Vec3d newton_to_zero(const SdfView& sdf, Vec3d q, double* phi_m, Vec3d* gradient) {
  sample(sdf, q, phi_m, gradient);
  const double g2 = dot(*gradient, *gradient);
  return g2 > 1e-12 ? q - (*phi_m / g2) * *gradient : q;
}

// From `start` to the point of the zero set nearest to p: steps onto the set and along it in turn (Chopp,
// SIAM J. Sci. Comput. 23, 2001, section 4.1). False when it does not settle, as where the field has a
// crease.
inline bool closest_zero(const SdfView& sdf, Vec3d p, Vec3d start, Vec3d* zero) {
  constexpr int kSteps = 20;
  const double tolerance = 1e-4 * static_cast<double>(sdf.voxel_m);
  Vec3d q = start, g;
  double phi = 0;
  for (int i = 0; i < kSteps; ++i) {
    const Vec3d onto = newton_to_zero(sdf, q, &phi, &g);
    const double g2 = dot(g, g);
    if (!(g2 > 1e-12)) return false;
    const Vec3d to_p = p - onto, along = to_p - (dot(to_p, g) / g2) * g;
    const Vec3d next = onto + 0.5 * along;
    const double moved = norm(next - q);
    q = next;
    if (moved < tolerance) break;
    if (i + 1 == kSteps) return false;
  }
  for (int i = 0; i < 4; ++i) q = newton_to_zero(sdf, q, &phi, &g);
  sample(sdf, q, &phi, &g);
  *zero = q;
  return std::abs(phi) <= 1e-3 * static_cast<double>(sdf.voxel_m);
}

}  // namespace sdftrack
