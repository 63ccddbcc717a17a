// SPDX-License-Identifier: MIT
// Replaces pose_fits.cu in a build without CUDA: throws an error.
#include "base/no_cuda.h"
#include "energies/pose_fits.h"

namespace sdftrack::energies {

template <class Field, class Penalty>
int CudaPoseFits<Field, Penalty>::run(CudaWork*, std::vector<Problem>*, std::vector<Fit>*,
                                      std::vector<optim::LmStep>*, int, PixelSet*) {
  no_cuda();
}
template struct CudaPoseFits<SingleObject<float>, DepthLogistic<float>>;
template struct CudaPoseFits<ScaledObject<float>, DepthLogistic<float>>;
template struct CudaPoseFits<SingleObject<float>, ColorOdds<float>>;
template struct CudaPoseFits<SingleObject<float>, ColorPrinted<float>>;

}  // namespace sdftrack::energies
