// SPDX-License-Identifier: MIT
// What a build without CUDA has in place of zero_mesh.cu: one error.
#include "base/no_cuda.h"
#include "levelset/zero_mesh.h"

namespace sdftrack::levelset {

ZeroMesh zero_mesh_cuda(const sdf::Grid&, const float*, int) { no_cuda(); }

}  // namespace sdftrack::levelset
