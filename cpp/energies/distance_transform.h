// SPDX-License-Identifier: MIT
// Where the sensor sees past the object: distance to the nearest pixel that might show the object.
#pragma once

#include <vector>

#include "energies/free_space_residual.h"

namespace sdftrack::energies {

// A grid over a region of the image, at least 2 x 2 nodes, one every `step` pixels; beyond it the border's
// value.
struct DistanceGrid {
  int x0 = 0, y0 = 0;  // pixel of node (0, 0)
  int step = 1;        // pixels between nodes
  int width = 0, height = 0;
  std::vector<float> distance_px;  // Euclidean, 0 at a node that is not free, at most limit_px
  float limit_px = 32;

  bool empty() const { return distance_px.empty(); }
  DistanceView view() const { return {distance_px.data(), x0, y0, step, width, height}; }
};

// Fills distance_px from `free` (1: every pixel that the node stands for has a measurement behind the
// object), row-major width x height. Exact Euclidean distance between nodes: first along the columns, then
// along the rows up to the limit. `scratch` is working memory, kept by the caller from frame to frame.
struct DistanceScratch {
  std::vector<float> squared, row;
};
void distance_transform(const std::vector<unsigned char>& free, DistanceScratch* scratch, DistanceGrid* grid);

}  // namespace sdftrack::energies
