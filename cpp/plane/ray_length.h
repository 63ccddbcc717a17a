// SPDX-License-Identifier: MIT
// Depth that is the distance along the ray where Z is expected: it bends every plane.
#pragma once

#include "base/camera.h"
#include "frame/region.h"

namespace sdftrack::plane {

// Whether some plane holds a third of the readings if they are distances along their rays, and none holds two
// thirds as many if they are Z. A scene without a large plane does not tell.
bool is_ray_length(const frame::DepthFrame& frame, const Camera& camera);

}  // namespace sdftrack::plane
