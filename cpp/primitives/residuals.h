// SPDX-License-Identifier: MIT
// The residuals: from a measurement to the solid, and from an outline ray to the solid.
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

// The distance along the ray from the measurement to the solid, positive if the solid is behind. phi at the
// point where the ray misses the solid or meets it at a grazing angle (docs/math/depth_tracker.md, 2), and
// everywhere in the printed form, which has no rays (thesis Eq. 3.12).
void ray_residual(const PrimitiveField& field, Vec3d p_cam, SolidResidual* out);

// Least distance along a ray: below 0, the ray hits the solid. docs/math/primitives.md, section 3.
void clearance(const PrimitiveField& field, const OutlineRay& ray, SolidResidual* out);

}  // namespace sdftrack::primitives
