// SPDX-License-Identifier: MIT
// The zero set of a volume as a mesh, by marching cubes (cube_cases.h).
#pragma once

#include <cstdint>
#include <vector>

#include "sdf/grid.h"

namespace sdftrack::levelset {

struct ZeroMesh {
  std::vector<double> vertices;     // x, y, z of each, in voxels
  std::vector<std::int32_t> faces;  // three vertices per face, counter-clockwise seen from outside
};

// One vertex on each edge between voxels that the surface cuts, shared by all triangles there. The mesh is
// closed except at the volume's border. Vertices and faces are ordered by block of voxels, then by voxel.
ZeroMesh zero_mesh(const sdf::Grid& grid, const float* phi, int threads = 0);

// The same mesh, found on a CUDA device. phi: in host memory, also as a copy of device memory
// (base/device_copies.h).
ZeroMesh zero_mesh_cuda(const sdf::Grid& grid, const float* phi, int device);

}  // namespace sdftrack::levelset
