// SPDX-License-Identifier: MIT
// What a build without CUDA has in place of slic_cuda.cu: one error.
#include <stdexcept>

#include "superpixels/slic.h"

namespace sdftrack::superpixels {

SlicResult slic_cuda(const SlicImage&, const SlicOptions&, int*) {
  throw std::runtime_error("this build of sdftrack has no CUDA path");
}

}  // namespace sdftrack::superpixels
