// SPDX-License-Identifier: MIT
// Signed distance volume of a mesh with holes: the generalised winding number closes them.
#pragma once

#include <vector>

#include "sdf/bvh.h"
#include "sdf/grid.h"

namespace sdftrack::sdf {

// The surface is the mesh and, across its holes, the set of winding number 1/2.
std::vector<float> open_mesh_to_sdf(const MeshView& mesh, const Bvh& bvh, const Grid& grid, double band_vox,
                                    int threads);

}  // namespace sdftrack::sdf
