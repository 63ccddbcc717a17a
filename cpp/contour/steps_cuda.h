// SPDX-License-Identifier: MIT
// The evolution of a contour on the GPU: the formula of contour_terms.h, a thread for each cell.
#pragma once

#include "contour/evolution.h"

namespace sdftrack::contour {

// The same as evolve_contour on the CPU, in the same band, with bitwise equal results. Throws
// std::runtime_error where the build or the machine has no CUDA; the grid is unchanged after an exception.
void evolve_contour_cuda(const ContourOptions& options, int steps, int device, EvolutionWork* work,
                         ContourGrid* grid);

}  // namespace sdftrack::contour
