// SPDX-License-Identifier: MIT
// The share of an outline with the object's colours next to it (docs/math/contour.md, section 8).
#pragma once

#include <vector>

#include "contour/region.h"

namespace sdftrack::contour {

// A square of the grid that the outline runs through.
struct OutlinePart {
  int column, row;  // of squares
  int length;       // cells of the outline
  double overlap;   // sum of sqrt(p q) over the colours just outside and the object's colours nearby
};

struct SharedColorsWork {
  std::vector<float> object, beside;  // histograms of each square, where it has cells
  std::vector<int> object_cells, beside_cells, length;
  std::vector<OutlinePart> parts;
  std::vector<int> colors;    // of a square, beside the outline
  std::vector<float> shares;  // of the object, of each of them
};

// The share of the outline, 0 to 1, that has the object's colours next to it, so that nothing holds it there.
// Parts with next to no cells on a side are ignored. phi reaches a few cells beyond the band.
double shared_outline(const RgbView& image, const ContourGrid& grid, SharedColorsWork* work);

}  // namespace sdftrack::contour
