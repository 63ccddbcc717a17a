// SPDX-License-Identifier: MIT
// A build without CUDA has this in place of raycast_sdf.cu: an error.
#include "base/no_cuda.h"
#include "render/raycast_sdf.h"

namespace sdftrack::render {

SdfImage raycast_sdf_cuda(const SdfView&, const Camera&, const Rigidd&, int) { no_cuda(); }

}  // namespace sdftrack::render
