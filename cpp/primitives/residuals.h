// SPDX-License-Identifier: MIT
// The lengths that are penalised: from a reading to the solid, and from a ray of the picture's edge to it.
#pragma once

#include "primitives/field.h"
#include "primitives/view.h"

namespace sdftrack::primitives {

struct SolidResidual {
  double m;
  double J[PrimitiveField::P];
};

// phi at the point.
void point_residual(const PrimitiveField& field, Vec3d p_cam, SolidResidual* out);

// The way along the reading's ray to the solid, positive where the solid lies behind it; where the ray does
// not meet the solid, or at a grazing angle, phi at the point (docs/math/depth_tracker.md, section 2).
void ray_residual(const PrimitiveField& field, Vec3d p_cam, SolidResidual* out);

// Least phi along a ray: below 0, the ray hits the solid. docs/math/primitives.md, section 3.
void clearance(const PrimitiveField& field, const OutlineRay& ray, SolidResidual* out);

}  // namespace sdftrack::primitives
