// SPDX-License-Identifier: MIT
// In a build without CUDA, in place of the .cu files of this folder: the error of no_cuda.h.
#include "base/no_cuda.h"
#include "render/raycast_mesh.h"
#include "render/raycast_sdf.h"

namespace sdftrack::render {

SdfImage raycast_sdf_cuda(const SdfView&, const Camera&, const Rigidd&, int) { no_cuda(); }

MeshImage raycast_mesh_cuda(const sdf::MeshView&, const sdf::Bvh&, std::uint64_t, const std::uint8_t*,
                            const Camera&, const Rigidd&, int) {
  no_cuda();
}

}  // namespace sdftrack::render
