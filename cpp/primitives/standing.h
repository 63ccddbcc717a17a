// SPDX-License-Identifier: MIT
// What stands or lies on a plane: how far the solid is off it, with derivatives by the unknowns.
#pragma once

#include "frame/region.h"
#include "primitives/residuals.h"
#include "primitives/solids.h"

namespace sdftrack::primitives {

// What of a solid lies on the plane that it stands on.
enum class Rest {
  kPoint,  // its lowest point
  kBase,   // all of a cone's base, or of the end of a cylinder that is lower
  kSide,   // a line of a cylinder's side
};

// A patch that is seen close above the table and parallel to it is the top of something: what stands is
// steep.
bool may_stand(const PrimitiveField& field, const frame::Plane& plane);

// The gap between the solid and the plane, and its derivative: the plane's distance at the lowest point.
void standing_residual(const PrimitiveField& field, const PrimitiveSize& size, const frame::Plane& plane,
                       SolidResidual* out);

// Of what lies on the plane with a base or along a line: the gap (m) below the base's middle or the line,
// then the turns away from lying flat (their sines). Free of the kink that the lowest point's gap has where
// the base is level or the line lies. Returns how many of `out` there are.
int resting_residuals(const PrimitiveField& field, const PrimitiveSize& size, const frame::Plane& plane,
                      Rest rest, SolidResidual (&out)[3]);

}  // namespace sdftrack::primitives
