// SPDX-License-Identifier: MIT
// Marching cubes: the triangles of a cell of eight voxels, by the set of voxels that are inside. Corner k of
// a cell is at (k & 1, k >> 1 & 1, k >> 2).
#pragma once

#include <array>
#include <cstdint>

#include "base/hd.h"

namespace sdftrack::levelset {

// NaN counts as inside, and so does a voxel on the surface.
HD bool is_inside(float phi) { return !(phi > 0); }

// Where the surface cuts the edge between two voxels, as a share from the first.
HD double cut_between(float phi, float next) {
  const double from = phi, to = next;
  return from / (from - to);
}

// An edge along `axis` from the corner with a 0 in this bit. Number: 4 axis + the corner without this bit.
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
  std::uint8_t edges[3 * kMostTriangles];  // three per triangle, counter-clockwise seen from outside
};

// Indexed by the bits of the inside corners. Between only two opposite inside corners of a face the surface
// separates them: a rule of the face alone, so that both cells agree and the surface has no holes.
std::array<CubeCase, kCubeCases> make_cube_cases();

}  // namespace sdftrack::levelset
