// SPDX-License-Identifier: MIT
// A plane patch and rays: in closed form, for its phi has no inside that an iteration could cross
// (docs/math/primitives.md, section 8).
#pragma once

#include "primitives/residuals.h"

namespace sdftrack::primitives {

// The way along the reading's ray to the patch, as ray_residual: of readings before and behind it alike.
// False where the ray passes beside it, or meets it at more than the angle whose cosine is `grazing`.
bool patch_way(const PrimitiveField& field, Vec3d p_cam, double grazing, SolidResidual* out);

// The least phi along the ray; where the ray passes through the patch, minus the distance from the rim, which
// falls to 0 steeply where the stretch ends in the patch.
void patch_clearance(const PrimitiveField& field, const OutlineRay& ray, SolidResidual* out);

}  // namespace sdftrack::primitives
