// SPDX-License-Identifier: MIT
// The colours of a mesh's surface, on the voxels beside it.
#pragma once

#include <cstdint>
#include <vector>

#include "sdf/bvh.h"
#include "sdf/grid.h"

namespace sdftrack::sdf {

// RGBA by voxel: the colour of the nearest point of the mesh, mixed from its face's corners, within reach_m
// of it; beyond, 0 with alpha 0. vertex_rgb: 3 per vertex. `phi`: distances on the grid, which only save
// work.
std::vector<std::uint8_t> paint(const MeshView& mesh, const std::uint8_t* vertex_rgb, const Grid& grid,
                                const float* phi, double reach_m, int threads);

}  // namespace sdftrack::sdf
