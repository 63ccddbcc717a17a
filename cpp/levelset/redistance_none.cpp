// SPDX-License-Identifier: MIT
// Replaces redistance.cu in a build without CUDA: throws an error.
#include "base/no_cuda.h"
#include "levelset/redistance.h"

namespace sdftrack::levelset {

std::vector<float> redistance_cuda(const sdf::Grid&, const float*, int) { no_cuda(); }

}  // namespace sdftrack::levelset
