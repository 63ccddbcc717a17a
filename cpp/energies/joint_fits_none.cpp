// SPDX-License-Identifier: MIT
// Replaces joint_fits.cu in a build without CUDA: throws an error.
#include "base/no_cuda.h"
#include "energies/joint_fits.h"

namespace sdftrack::energies {

void fit_together(CudaWork*, const JointTask&, JointFound*) { no_cuda(); }

}  // namespace sdftrack::energies
