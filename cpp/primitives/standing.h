// SPDX-License-Identifier: MIT
// The distance of a solid from the plane that it stands or lies on, with derivatives by the unknowns.
#pragma once

#include "frame/region.h"
#include "primitives/residuals.h"
#include "primitives/solids.h"

namespace sdftrack::primitives {

// Which part of a solid touches the plane that it stands on.
enum class Rest {
  kPoint,  // its lowest point
  kBase,   // the whole base of a cone, or the lower end of a cylinder
  kSide,   // a line on the side of a cylinder
};

// Whether the solid may stand on the plane. A parallel patch is the top of something; a steep one may.
bool may_stand(const PrimitiveField& field, const frame::Plane& plane);

// The gap between the solid and the plane, and its derivative: the lowest point's distance from the plane.
void standing_residual(const PrimitiveField& field, const PrimitiveSize& size, const frame::Plane& plane,
                       SolidResidual* out);

// For a solid that touches the plane with a base or along a line: the gap (m) below the centre of the base or
// the line, then the sines of the angles away from lying flat. These have no kink where the base or the line
// lies flat; the lowest point's gap has one. Returns the number of residuals in `out`.
int resting_residuals(const PrimitiveField& field, const PrimitiveSize& size, const frame::Plane& plane,
                      Rest rest, SolidResidual (&out)[3]);

}  // namespace sdftrack::primitives
