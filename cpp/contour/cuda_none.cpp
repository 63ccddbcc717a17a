// SPDX-License-Identifier: MIT
// In a build without CUDA, in place of the .cu files of this folder: the error of no_cuda.h.
#include "base/no_cuda.h"
#include "contour/steps_cuda.h"

namespace sdftrack::contour {

void evolve_contour_cuda(const ContourOptions&, int, int, EvolutionWork*, ContourGrid*) { no_cuda(); }

}  // namespace sdftrack::contour
