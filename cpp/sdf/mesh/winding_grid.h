// SPDX-License-Identifier: MIT
// Generalised winding number of an open mesh at every voxel, for little more than the sum at a few.
#pragma once

#include <vector>

#include "sdf/grid.h"
#include "sdf/mesh.h"

namespace sdftrack::sdf {

// `u`: unsigned distance (m) of every voxel to the mesh, exact below a voxel. Each number is on the same side
// of 1/2 as the sum at its voxel; next to a crossing of 1/2 without a triangle it equals the sum.
//
// The number jumps by 1 at triangles and is smooth elsewhere, the smoother the farther the rims of the holes
// are (docs/math/mesh_to_sdf.md, 2). So in a block of voxels away from the rims one sum and the jumps,
// counted along the rows, suffice; an uncertain block is split into eight.
std::vector<float> winding_of_open_mesh(const MeshView& mesh, const Grid& grid, const std::vector<float>& u,
                                        int threads);

}  // namespace sdftrack::sdf
