// SPDX-License-Identifier: MIT
// Replaces slic_cuda.cu in a build without CUDA: one error.
#include "base/no_cuda.h"
#include "superpixels/slic.h"

namespace sdftrack::superpixels {

SlicResult slic_cuda(const SlicImage&, const SlicOptions&, int, int*, DeviceArray*) { no_cuda(); }

}  // namespace sdftrack::superpixels
