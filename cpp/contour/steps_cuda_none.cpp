// SPDX-License-Identifier: MIT
// What a build without CUDA has in place of steps_cuda.cu: one error.
#include <stdexcept>

#include "contour/steps_cuda.h"

namespace sdftrack::contour {

std::vector<float> contour_steps_cuda(const ContourOptions&, int, int, int, const float*, const float*) {
  throw std::runtime_error("this build of sdftrack has no CUDA path");
}

}  // namespace sdftrack::contour
