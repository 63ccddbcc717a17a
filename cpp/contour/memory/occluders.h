// SPDX-License-Identifier: MIT
// The number of occluders in front of a silhouette, from its missing pieces.
#pragma once

#include "contour/memory/plane.h"

namespace sdftrack::contour {

// Number of pieces of `hidden`; pieces without a visible part of the object between them count as one. A bar
// in front of four legs hides four pieces with background between them; between the slats of a fence the
// object is visible. Pieces smaller than `of_largest` times the largest are not counted.
int count_occluders(const Mask& hidden, const Mask& seen, double of_largest = 0);

}  // namespace sdftrack::contour
