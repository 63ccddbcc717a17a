// SPDX-License-Identifier: MIT
// In a build without CUDA, in place of the .cu files of this folder: the error of no_cuda.h.
#include "base/no_cuda.h"
#include "superpixels/slic.h"

namespace sdftrack::superpixels {

SlicResult slic_cuda(const SlicImage&, const SlicOptions&, int, int*, DeviceArray*) { no_cuda(); }

}  // namespace sdftrack::superpixels
