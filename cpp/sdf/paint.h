// SPDX-License-Identifier: MIT
// The colours of a mesh's surface, on the voxels next to it.
#pragma once

#include <cstdint>
#include <vector>

#include "sdf/bvh.h"
#include "sdf/grid.h"

namespace sdftrack::sdf {

// RGBA per voxel: the colour of the nearest point of the mesh, interpolated from the face's corners, within
// reach_m; beyond, 0 with alpha 0. vertex_rgb: 3 per vertex. `phi`: distances on the grid, only to save work.
std::vector<std::uint8_t> paint(const MeshView& mesh, const std::uint8_t* vertex_rgb, const Grid& grid,
                                const float* phi, double reach_m, int threads);

}  // namespace sdftrack::sdf
