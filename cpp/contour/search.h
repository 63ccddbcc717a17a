// SPDX-License-Identifier: MIT
// Tries the shape at places on a lattice: for motion beyond the range of Gauss-Newton, and for a lost object.
#pragma once

#include <vector>

#include "contour/region_model.h"

namespace sdftrack::contour {

// A few hundred cells inside the contour and just outside it, relative to the middle of the grid.
struct ShapeSamples {
  std::vector<float> in_x, in_y, out_x, out_y;
};
// Leaves out cells that are known to be hidden (nullptr: no such cells).
void choose_samples(const ContourGrid& grid, float band, const unsigned char* hidden, ShapeSamples* samples);

// Mean posterior inside minus that just outside the contour, -1 .. 1.
double contrast_at(const ShapeSamples& samples, const GridWarp& warp, const PosteriorImage& posterior);

// The best place within `reach` pixels along both axes, in steps of `step`, then refined. Returns its
// contrast.
double search_place(const ShapeSamples& samples, const PosteriorImage& posterior, int reach, int step,
                    GridWarp* warp);

}  // namespace sdftrack::contour
