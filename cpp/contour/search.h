// SPDX-License-Identifier: MIT
// The shape tried at places on a lattice: for motion that Gauss-Newton does not bridge, and for what was
// lost.
#pragma once

#include <vector>

#include "contour/region_model.h"

namespace sdftrack::contour {

// A few hundred cells inside the contour and beside it, from the middle of the grid.
struct ShapeSamples {
  std::vector<float> in_x, in_y, out_x, out_y;
};
// None of those that are known to be hidden (nullptr: none are).
void choose_samples(const ContourGrid& grid, float band, const unsigned char* hidden, ShapeSamples* samples);

// Mean posterior inside less that beside the contour, -1 .. 1.
double contrast_at(const ShapeSamples& samples, const GridWarp& warp, const PosteriorImage& posterior);

// The best of the places within `reach` pixels along both axes, `step` pixels apart and then refined to one
// pixel. Returns its contrast.
double search_place(const ShapeSamples& samples, const PosteriorImage& posterior, int reach, int step,
                    GridWarp* warp);

}  // namespace sdftrack::contour
