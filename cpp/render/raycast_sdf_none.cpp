// SPDX-License-Identifier: MIT
// What a build without CUDA has in place of raycast_sdf.cu: one error.
#include "base/no_cuda.h"
#include "render/raycast_sdf.h"

namespace sdftrack::render {

SdfImage raycast_sdf_cuda(const SdfView&, const Camera&, const Rigidd&, int) { no_cuda(); }

}  // namespace sdftrack::render
