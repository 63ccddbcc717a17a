// SPDX-License-Identifier: MIT
// What a build without CUDA has in place of selection_cuda.cu: one error.
#include "base/no_cuda.h"
#include "frame/selection_cuda.h"

namespace sdftrack::frame {

PixelsOnDevice choose_on_device(energies::CudaWork*, const DepthFrame&, const std::vector<Lookout>&, int) {
  no_cuda();
}

}  // namespace sdftrack::frame
