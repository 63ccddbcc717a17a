// SPDX-License-Identifier: MIT
// Signed distance volume of a closed mesh: exact near the surface, swept outwards and inwards from there.
#pragma once

#include <vector>

#include "sdf/bvh.h"
#include "sdf/grid.h"
#include "sdf/mesh.h"

namespace sdftrack::sdf {

constexpr double kBandVoxels = 6;  // half width of the exact band (docs/math/mesh_to_sdf.md, section 3)

struct MeshSdf {
  std::vector<float> phi;
  std::size_t inside_out = 0;  // voxels of negative winding number: a part is inside out
};

// Unsigned distance (m) to the triangles: exact within band_vox voxels, swept beyond.
std::vector<float> mesh_distance(const Bvh& bvh, const Grid& grid, double band_vox, int threads);

// The mesh must be closed: edges are used equally often both ways (mesh_report). threads 0: all cores.
MeshSdf mesh_to_sdf(const MeshView& mesh, const Bvh& bvh, const Grid& grid, double band_vox, int threads);

}  // namespace sdftrack::sdf
