// SPDX-License-Identifier: MIT
// Projection of a camera point to a colour pixel, from the depth-to-colour pixel map that a frame comes with.
#pragma once

#include "appearance/color_map.h"
#include "energies/color_projection.h"

namespace sdftrack::tracking {

energies::ColorProjection color_projection(const Camera& camera, const appearance::ColorMap& map);

}  // namespace sdftrack::tracking
