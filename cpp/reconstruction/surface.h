// SPDX-License-Identifier: MIT
// The surface of a reconstruction as a watertight coloured mesh.
#pragma once

#include <cstdint>
#include <vector>

#include "reconstruction/reconstruction.h"
#include "sdf/mesh.h"

namespace sdftrack::reconstruction {

struct SurfaceMesh {
  std::vector<Vec3d> vertices;      // m, object frame
  std::vector<std::int32_t> faces;  // three vertices of each, counter-clockwise seen from outside
  std::vector<std::uint8_t> rgb;    // three bytes per vertex, the mean of what was seen; empty: no colours
  std::vector<float> seen;          // of each vertex: equivalent frontal views; 0: guessed
};

// Marching cubes of the largest body. What was not observed is smooth, and not hollow. Throws
// std::runtime_error without a surface.
SurfaceMesh surface_mesh(const Reconstruction& volume, int threads);

// A frame provides evidence only up to a few millimetres behind a surface. Voxels without evidence are set
// inside if grid lines in at least five of the six directions lead to inside, and not to observed free space.
void fill_cavities(int nx, int ny, int nz, const float* weight, float* phi);

}  // namespace sdftrack::reconstruction
