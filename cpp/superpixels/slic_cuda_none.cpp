// SPDX-License-Identifier: MIT
// What a build without CUDA has in place of slic_cuda.cu: one error.
#include "base/no_cuda.h"
#include "superpixels/slic.h"

namespace sdftrack::superpixels {

SlicResult slic_cuda(const SlicImage&, const SlicOptions&, int, int*, DeviceArray*) { no_cuda(); }

}  // namespace sdftrack::superpixels
