// SPDX-License-Identifier: MIT
#include "sdf/mesh/open_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/parallel.h"
#include "sdf/mesh/winding_grid.h"
#include "sdf/mesh_to_sdf.h"
#include "sdf/sweep.h"

namespace sdftrack::sdf {

namespace {

// Distance from a voxel to where the winding number crosses 1/2 without a triangle, in a hole. 0: none.
double hole_distance(const Grid& grid, const std::vector<float>& u, const std::vector<float>& w, int ix,
                     int iy, int iz) {
  const std::size_t i = grid.index(ix, iy, iz);
  const int at[3] = {ix, iy, iz}, count[3] = {grid.nx, grid.ny, grid.nz};
  const std::size_t stride[3] = {1, std::size_t(grid.nx), grid.index(0, 0, 1)};
  double inverse2 = 0;
  for (int axis = 0; axis < 3; ++axis) {
    double nearest = 2;
    for (int side : {-1, 1}) {
      if (at[axis] + side < 0 || at[axis] + side >= count[axis]) continue;
      const std::size_t k = side < 0 ? i - stride[axis] : i + stride[axis];
      const bool differ = (w[k] > 0.5f) != (w[i] > 0.5f);
      // A triangle between two neighbours: the sum of its distances from both is at most their spacing.
      if (differ && u[i] + u[k] > 1.001 * grid.voxel_m)
        nearest = std::min(nearest, std::abs(w[i] - 0.5) / std::max(1e-12f, std::abs(w[i] - w[k])));
    }
    if (nearest <= 1) inverse2 += 1 / std::max(nearest * nearest, 1e-12);
  }
  return inverse2 > 0 ? grid.voxel_m / std::sqrt(inverse2) : 0;
}

}  // namespace

OpenMeshSdf open_mesh_to_sdf(const MeshView& mesh, const Bvh& bvh, const Grid& grid, double band_vox,
                             int threads) {
  OpenMeshSdf out{mesh_distance(bvh, grid, band_vox, threads), 0};
  std::vector<float>& u = out.phi;
  const std::vector<float> w = winding_of_open_mesh(mesh, grid, u, threads);
  std::vector<float> hole(grid.size());
  std::vector<std::uint8_t> known(grid.size(), 0);
  parallel_for(grid.nz, threads, [&](std::size_t chunk) {
    const int iz = int(chunk);
    for (int iy = 0; iy < grid.ny; ++iy)
      for (int ix = 0; ix < grid.nx; ++ix)
        if (const double d = hole_distance(grid, u, w, ix, iy, iz); d > 0) {
          hole[grid.index(ix, iy, iz)] = float(d);
          known[grid.index(ix, iy, iz)] = 1;
        }
  });
  for (std::uint8_t k : known) out.gap_voxels += k;
  if (out.gap_voxels) {
    fast_sweep(grid, known, threads, &hole);
    for (std::size_t i = 0; i < u.size(); ++i) u[i] = std::min(u[i], hole[i]);
  }
  for (std::size_t i = 0; i < u.size(); ++i)
    if (w[i] > 0.5f) u[i] = -u[i];
  return out;
}

}  // namespace sdftrack::sdf
