// SPDX-License-Identifier: MIT
// What a build without CUDA has in place of steps_cuda.cu: one error.
#include "base/no_cuda.h"
#include "contour/steps_cuda.h"

namespace sdftrack::contour {

void evolve_contour_cuda(const ContourOptions&, int, int, EvolutionWork*, ContourGrid*) { no_cuda(); }

}  // namespace sdftrack::contour
