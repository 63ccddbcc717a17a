// SPDX-License-Identifier: MIT
// Detects depth given as distance along the ray instead of Z, which bends every plane.
#pragma once

#include "base/camera.h"
#include "frame/region.h"

namespace sdftrack::plane {

// True if some plane holds a third of the measurements taken as distances along rays, and none holds two
// thirds as many taken as Z. False for a scene without a large plane.
bool is_ray_length(const frame::DepthFrame& frame, const Camera& camera);

}  // namespace sdftrack::plane
