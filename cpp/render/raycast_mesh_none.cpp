// SPDX-License-Identifier: MIT
// A build without CUDA has this in place of raycast_mesh.cu: an error.
#include "base/no_cuda.h"
#include "render/raycast_mesh.h"

namespace sdftrack::render {

MeshImage raycast_mesh_cuda(const sdf::MeshView&, const sdf::Bvh&, std::uint64_t, const std::uint8_t*,
                            const Camera&, const Rigidd&, int) {
  no_cuda();
}

}  // namespace sdftrack::render
