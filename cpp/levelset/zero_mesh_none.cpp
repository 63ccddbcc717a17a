// SPDX-License-Identifier: MIT
// Replaces zero_mesh.cu in a build without CUDA: throws an error.
#include "base/no_cuda.h"
#include "levelset/zero_mesh.h"

namespace sdftrack::levelset {

ZeroMesh zero_mesh_cuda(const sdf::Grid&, const float*, int) { no_cuda(); }

}  // namespace sdftrack::levelset
