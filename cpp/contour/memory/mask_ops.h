// SPDX-License-Identifier: MIT
// Operations on masks: rims, slivers, distances, pieces.
#pragma once

#include <vector>

#include "contour/memory/plane.h"

namespace sdftrack::contour {

int area_of(const Mask& mask);
inline Mask both(const Mask& a, const Mask& b) {
  return each<unsigned char>(a, b, [](unsigned char x, unsigned char y) { return x & y; });
}
inline Mask union_of(const Mask& a, const Mask& b) {
  return each<unsigned char>(a, b, [](unsigned char x, unsigned char y) { return x | y; });
}
// Pixels of `a` that are not in `b`.
inline Mask without(const Mask& a, const Mask& b) {
  return each<unsigned char>(a, b, [](unsigned char x, unsigned char y) { return x & (y ^ 1); });
}
// Pixels with a negative distance.
Mask inside_of(const Picture& phi);

// Pixels inside that have one of their four neighbours outside, or beyond the border.
Mask edge_of(const Mask& mask);
// All pixels within `by` of the mask along each axis.
Mask grown(const Mask& mask, int by);
// The parts thicker than 2 `sliver` pixels, including their rim.
Mask thick_parts(const Mask& mask, int sliver);

// Distance of each pixel to the edge between inside and outside, in pixels, negative inside, clamped to
// `reach_px`. The edge lies half a pixel before the first outside pixel.
Picture signed_distances(const Mask& mask, float reach_px);

// Pieces connected over sides and corners: each pixel's number, from 1 on, 0 outside; areas by number.
struct Pieces {
  Plane<int> numbers;
  std::vector<int> areas = {0};
};
Pieces pieces_of(const Mask& mask);

}  // namespace sdftrack::contour
