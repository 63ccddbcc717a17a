// SPDX-License-Identifier: MIT
// Generalised winding number of an open mesh at every voxel, for little more than its sum at a few of them.
#pragma once

#include <vector>

#include "sdf/grid.h"
#include "sdf/mesh.h"

namespace sdftrack::sdf {

// `u`: unsigned distance (m) of every voxel to the mesh, exact below a voxel. On which side of 1/2 a number
// lies is that of its own sum; beside a crossing of 1/2 that is no triangle's, so is the number.
//
// The number jumps by 1 at triangles and is smooth elsewhere, the smoother the farther the rims of the holes
// are (docs/math/mesh_to_sdf.md, 2). So in a block of voxels that keeps its distance from the rims one sum
// and the jumps, counted along the rows, are enough; a block that is not sure is cut in eight.
std::vector<float> winding_of_open_mesh(const MeshView& mesh, const Grid& grid, const std::vector<float>& u,
                                        int threads);

}  // namespace sdftrack::sdf
