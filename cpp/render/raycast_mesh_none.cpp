// SPDX-License-Identifier: MIT
// What a build without CUDA has in place of raycast_mesh.cu: one error.
#include "base/no_cuda.h"
#include "render/raycast_mesh.h"

namespace sdftrack::render {

MeshImage raycast_mesh_cuda(const sdf::MeshView&, const sdf::Bvh&, std::uint64_t, const std::uint8_t*,
                            const Camera&, const Rigidd&, int) {
  no_cuda();
}

}  // namespace sdftrack::render
