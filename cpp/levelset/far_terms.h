// SPDX-License-Identifier: MIT
// Distances beyond the band, from every kCoarse-th voxel (docs/math/reconstruction.md, section 3).
#pragma once

#include "levelset/eikonal_terms.h"
#include "sdf/grid.h"

namespace sdftrack::levelset {

constexpr int kCoarse = 4;

HD int coarse_nodes(int voxels) { return (voxels - 1 + kCoarse - 1) / kCoarse + 1; }
HD sdf::Grid coarse_lattice(const sdf::Grid& grid) {
  return {coarse_nodes(grid.nx), coarse_nodes(grid.ny), coarse_nodes(grid.nz), kCoarse * grid.voxel_m,
          grid.origin_obj};
}
// The voxel of a node; beyond the volume, the last one of an axis.
HD std::size_t coarse_voxel(const sdf::Grid& grid, int x, int y, int z) {
  return grid.index(least(kCoarse * x, grid.nx - 1), least(kCoarse * y, grid.ny - 1),
                    least(kCoarse * z, grid.nz - 1));
}

// The place of a voxel between the nodes of an axis.
struct CoarsePlace {
  int cell;
  float share;
};
HD CoarsePlace coarse_place(int voxel, int nodes) {
  const int cell = least(voxel / kCoarse, nodes - 2);
  return {cell, 1.0f / kCoarse * float(voxel) - float(cell)};
}
HD float mix(float a, float b, float t) { return a + t * (b - a); }
// Interpolates along y and z between the nodes with the given x.
HD float mix_across(const float* coarse, const sdf::Grid& lattice, int x, const CoarsePlace& y,
                    const CoarsePlace& z) {
  const float *const a = coarse + lattice.index(x, y.cell, z.cell), *const c =
                                                                        coarse +
                                                                        lattice.index(x, y.cell, z.cell + 1);
  return mix(mix(a[0], a[lattice.nx], y.share), mix(c[0], c[lattice.nx], y.share), z.share);
}
// A voxel within the band keeps its distance; another voxel keeps only its sign.
HD float far_distance(float own, float there, float band_m) {
  const float size = most(abs(there), band_m);
  return abs(own) < band_m ? own : copysign(size, own);
}

}  // namespace sdftrack::levelset
