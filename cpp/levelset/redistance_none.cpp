// SPDX-License-Identifier: MIT
// What a build without CUDA has in place of redistance.cu: one error.
#include "base/no_cuda.h"
#include "levelset/redistance.h"

namespace sdftrack::levelset {

std::vector<float> redistance_cuda(const sdf::Grid&, const float*, int) { no_cuda(); }

}  // namespace sdftrack::levelset
