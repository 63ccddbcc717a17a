// SPDX-License-Identifier: MIT
// Signed distance volume of a mesh with holes: the generalised winding number closes them.
#pragma once

#include <vector>

#include "sdf/bvh.h"
#include "sdf/grid.h"

namespace sdftrack::sdf {

struct OpenMeshSdf {
  std::vector<float> phi;
  std::size_t gap_voxels = 0;  // next to a surface that closes a hole; 0: no hole at this resolution
};

// The surface is the mesh and, across its holes, the set of winding number 1/2.
OpenMeshSdf open_mesh_to_sdf(const MeshView& mesh, const Bvh& bvh, const Grid& grid, double band_vox,
                             int threads);

}  // namespace sdftrack::sdf
