// SPDX-License-Identifier: MIT
// Winding number of a closed oriented mesh at every voxel, by counting signed crossings along each row in x
// (docs/math/mesh_to_sdf.md, 2).
#pragma once

#include <cstdint>
#include <vector>

#include "sdf/grid.h"
#include "sdf/mesh.h"

namespace sdftrack::sdf {

// One number per voxel: 0 outside, 1 inside, more where parts overlap, negative inside an inside-out part.
std::vector<std::int8_t> winding_numbers(const MeshView& mesh, const Grid& grid, int threads);

}  // namespace sdftrack::sdf
