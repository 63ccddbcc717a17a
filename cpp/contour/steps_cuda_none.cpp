// SPDX-License-Identifier: MIT
// Replaces steps_cuda.cu in a build without CUDA: one error.
#include "base/no_cuda.h"
#include "contour/steps_cuda.h"

namespace sdftrack::contour {

void evolve_contour_cuda(const ContourOptions&, int, int, EvolutionWork*, ContourGrid*) { no_cuda(); }

}  // namespace sdftrack::contour
