// SPDX-License-Identifier: MIT
// What is done to masks: rims, slivers, distances, pieces.
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
// Of `a` without `b`.
inline Mask without(const Mask& a, const Mask& b) {
  return each<unsigned char>(a, b, [](unsigned char x, unsigned char y) { return x & (y ^ 1); });
}
// Where a distance is negative.
Mask inside_of(const Picture& phi);

// Pixels inside that have one of their four neighbours outside, or beyond the border.
Mask edge_of(const Mask& mask);
// All pixels no farther than `by` along each axis.
Mask grown(const Mask& mask, int by);
// The parts thicker than 2 `sliver` pixels, including their rim.
Mask thick_parts(const Mask& mask, int sliver);

// Distance of each pixel to the edge between inside and outside, pixels, negative inside, no farther than
// `reach_px`. The edge lies half a pixel before the first pixel beyond.
Picture signed_distances(const Mask& mask, float reach_px);

// Pieces connected over sides and corners: the number of each pixel's, from 1 on, 0 outside; their areas by
// number.
struct Pieces {
  Plane<int> numbers;
  std::vector<int> areas = {0};
};
Pieces pieces_of(const Mask& mask);

}  // namespace sdftrack::contour
