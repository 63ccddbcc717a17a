// SPDX-License-Identifier: MIT
// The signed distance to a contour on a flat grid.
#pragma once

#include <vector>

#include "contour/region.h"

namespace sdftrack::contour {

struct FlatDistanceWork {
  std::vector<float> to_outside, to_inside, least, kept;
};

// Replaces phi by the signed distance to its zero set, clamped to `radius`: next to it phi over its slope,
// elsewhere the distance to the nearest cell of the other side minus half a cell. Sets grid->inside.
void redistance(int radius, FlatDistanceWork* work, ContourGrid* grid);

}  // namespace sdftrack::contour
