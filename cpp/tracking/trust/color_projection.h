// SPDX-License-Identifier: MIT
// The way from a camera point to a colour pixel, of the map from depth pixels that a frame comes with.
#pragma once

#include "appearance/color_map.h"
#include "energies/color_projection.h"

namespace sdftrack::tracking {

energies::ColorProjection color_projection(const Camera& camera, const appearance::ColorMap& map);

}  // namespace sdftrack::tracking
