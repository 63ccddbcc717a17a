// SPDX-License-Identifier: MIT
// How many things stand before a silhouette, from the pieces that it lacks.
#pragma once

#include "contour/memory/plane.h"

namespace sdftrack::contour {

// Pieces of `hidden`; those with no visible part of the object between them count as one. One bar before four
// legs hides four pieces with background between them; between the slats of a fence the object is visible.
// Pieces smaller than `of_largest` times the largest are not counted.
int count_occluders(const Mask& hidden, const Mask& seen, double of_largest = 0);

}  // namespace sdftrack::contour
