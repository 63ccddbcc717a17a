// SPDX-License-Identifier: MIT
// What a build without CUDA has in place of joint_fits.cu: one error.
#include "base/no_cuda.h"
#include "energies/joint_fits.h"

namespace sdftrack::energies {

void fit_together(CudaWork*, const JointTask&, JointFound*) { no_cuda(); }

}  // namespace sdftrack::energies
