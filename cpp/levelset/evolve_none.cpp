// SPDX-License-Identifier: MIT
// Replaces evolve.cu in a build without CUDA: throws an error.
#include "base/no_cuda.h"
#include "levelset/evolve.h"

namespace sdftrack::levelset {

std::vector<float> evolve_cuda(const sdf::Grid&, const float*, const float*, int, const EvolveOptions&, int) {
  no_cuda();
}

}  // namespace sdftrack::levelset
