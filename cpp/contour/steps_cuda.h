// SPDX-License-Identifier: MIT
// The evolution of a contour on the GPU: the formula of contour_terms.h, a thread for each cell.
#pragma once

#include <vector>

#include "contour/options.h"

namespace sdftrack::contour {

// phi after `steps` steps at the cells within options.band of the contour, but for the border of the grid:
// what evolve_contour does on the CPU,
// but that it does not bridge gaps of the band. std::runtime_error where the build or the machine has no
// CUDA.
std::vector<float> contour_steps_cuda(const ContourOptions& options, int steps, int nx, int ny,
                                      const float* phi, const float* foreground, int device = 0);

}  // namespace sdftrack::contour
