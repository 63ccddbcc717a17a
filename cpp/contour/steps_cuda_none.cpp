// SPDX-License-Identifier: MIT
// What a build without CUDA has in place of steps_cuda.cu: one error.
#include "base/no_cuda.h"
#include "contour/steps_cuda.h"

namespace sdftrack::contour {

std::vector<float> contour_steps_cuda(const ContourOptions&, int, int, int, const float*, const float*, int) {
  no_cuda();
}

}  // namespace sdftrack::contour
