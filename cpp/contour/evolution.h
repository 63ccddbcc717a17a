// SPDX-License-Identifier: MIT
// The evolution of the shape: level-set steps on the object's grid, and the removal of small pieces.
#pragma once

#include <vector>

#include "contour/distance.h"
#include "contour/options.h"
#include "contour/region_model.h"

namespace sdftrack::contour {

// Cells first .. last - 1 of a row.
struct CellRun {
  int row, first, last;
};

struct EvolutionWork {
  int device = -1;  // the GPU for evolve_contour, -1: the CPU
  std::vector<CellRun> band, pieces;
  std::vector<float> foreground, next;  // by cell
  std::vector<unsigned char> in_band;   // by cell, for a GPU
  std::vector<int> parent, area;        // of the runs in `pieces`
  FlatDistanceWork distance;
};

// Cells within `band` of the contour, without the border of the grid.
void find_band(const ContourGrid& grid, float band, std::vector<CellRun>* runs);
// The posterior at the cells of the band, one half outside the image.
void sample_posterior(const ContourGrid& grid, const PosteriorImage& posterior, EvolutionWork* work);
void evolve_contour(const ContourOptions& options, int steps, EvolutionWork* work, ContourGrid* grid);
// Removes pieces smaller than `min_part` of the largest, among the cells within `reach` of the box of the
// cells that were inside. Returns the number of cells inside.
int drop_small_pieces(float min_part, int reach, EvolutionWork* work, ContourGrid* grid);

}  // namespace sdftrack::contour
