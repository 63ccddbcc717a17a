// SPDX-License-Identifier: MIT
// A build without CUDA has this in place of selection_cuda.cu: an error.
#include "base/no_cuda.h"
#include "frame/selection_cuda.h"

namespace sdftrack::frame {

PixelsOnDevice choose_on_device(energies::CudaWork*, const DepthFrame&, const std::vector<Lookout>&, int) {
  no_cuda();
}

}  // namespace sdftrack::frame
