// SPDX-License-Identifier: MIT
// Marching cubes: the triangles of a cell of eight voxels, by which of them are inside. Corner k of a cell is
// at (k & 1, k >> 1 & 1, k >> 2).
#pragma once

#include <array>
#include <cstdint>

#include "base/hd.h"

namespace sdftrack::levelset {

// A voxel without a number counts as inside, and one on the surface, too.
HD bool is_inside(float phi) { return !(phi > 0); }

// Where the surface cuts the edge between two voxels, from the first on.
HD double cut_between(float phi, float next) {
  const double from = phi, to = next;
  return from / (from - to);
}

// An edge along `axis` from the corner with a 0 there: 4 axis + that corner's number without this bit.
struct CubeEdge {
  int axis, corner;
};
HD int number_of(CubeEdge e) {
  const int low = (1 << e.axis) - 1;
  return 4 * e.axis + ((e.corner & low) | (e.corner >> 1 & ~low));
}
HD CubeEdge cube_edge(int number) {
  const int axis = number >> 2, place = number & 3, low = (1 << axis) - 1;
  return {axis, (place & low) | (place & ~low) << 1};
}

constexpr int kMostTriangles = 5, kCubeCases = 256;
struct CubeCase {
  std::uint8_t triangles;
  std::uint8_t edges[3 * kMostTriangles];  // three of each triangle, counter-clockwise seen from outside
};

// By the bits of the corners that are inside. Where two corners of a face that face each other are inside and
// the others are not, the surface separates the two: a rule of the face alone, so that the cell behind it
// goes by the same lines and a surface has no holes.
std::array<CubeCase, kCubeCases> make_cube_cases();

}  // namespace sdftrack::levelset
