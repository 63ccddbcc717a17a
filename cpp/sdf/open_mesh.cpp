// SPDX-License-Identifier: MIT
#include "sdf/open_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/parallel.h"
#include "sdf/mesh_to_sdf.h"
#include "sdf/sweep.h"
#include "sdf/winding.h"

namespace sdftrack::sdf {

namespace {

constexpr int kCell = 4;
constexpr double kSure = 0.3;  // from 1/2: a cell whose centre is that sure, far from the mesh, has one sign

int cells(int n) { return (n + kCell - 1) / kCell; }

// Winding number of every voxel of one cell; far from mesh and holes the cell's centre speaks for all.
void fill_cell(const WindingTree& tree, const Grid& grid, const std::vector<float>& u, int x0, int y0, int z0,
               std::vector<float>* w) {
  const int x1 = std::min(x0 + kCell, grid.nx), y1 = std::min(y0 + kCell, grid.ny),
            z1 = std::min(z0 + kCell, grid.nz);
  const double centre = tree(0.5 * (grid.point(x0, y0, z0) + grid.point(x1 - 1, y1 - 1, z1 - 1)));
  const bool far = u[grid.index(x0, y0, z0)] > 3 * kCell * grid.voxel_m && std::abs(centre - 0.5) > kSure;
  for (int iz = z0; iz < z1; ++iz)
    for (int iy = y0; iy < y1; ++iy)
      for (int ix = x0; ix < x1; ++ix)
        (*w)[grid.index(ix, iy, iz)] = static_cast<float>(far ? centre : tree(grid.point(ix, iy, iz)));
}

// Distance of a voxel to where the winding number passes 1/2 without a triangle between: in a hole. 0:
// nowhere.
double hole_distance(const Grid& grid, const std::vector<float>& u, const std::vector<float>& w, int ix,
                     int iy, int iz) {
  const std::size_t i = grid.index(ix, iy, iz);
  const int at[3] = {ix, iy, iz}, count[3] = {grid.nx, grid.ny, grid.nz};
  const std::size_t stride[3] = {1, static_cast<std::size_t>(grid.nx), grid.index(0, 0, 1)};
  double inverse2 = 0;
  for (int axis = 0; axis < 3; ++axis) {
    double nearest = 2;
    for (int side : {-1, 1}) {
      if (at[axis] + side < 0 || at[axis] + side >= count[axis]) continue;
      const std::size_t k = side < 0 ? i - stride[axis] : i + stride[axis];
      const bool differ = (w[k] > 0.5f) != (w[i] > 0.5f);
      // A triangle between two neighbours is no farther from both together than they are apart.
      if (differ && u[i] + u[k] > 1.001 * grid.voxel_m)
        nearest = std::min(nearest, std::abs(w[i] - 0.5) / std::max(1e-12f, std::abs(w[i] - w[k])));
    }
    if (nearest <= 1) inverse2 += 1 / std::max(nearest * nearest, 1e-12);
  }
  return inverse2 > 0 ? grid.voxel_m / std::sqrt(inverse2) : 0;
}

}  // namespace

std::vector<float> open_mesh_to_sdf(const MeshView& mesh, const Bvh& bvh, const Grid& grid, double band_vox,
                                    int threads) {
  std::vector<float> u = mesh_distance(bvh, grid, band_vox, threads);
  const WindingTree tree(mesh);
  std::vector<float> w(grid.size());
  parallel_for(static_cast<std::size_t>(cells(grid.nz)), threads, [&](std::size_t chunk) {
    for (int y = 0; y < grid.ny; y += kCell)
      for (int x = 0; x < grid.nx; x += kCell)
        fill_cell(tree, grid, u, x, y, static_cast<int>(chunk) * kCell, &w);
  });
  std::vector<float> hole(grid.size());
  std::vector<std::uint8_t> known(grid.size(), 0);
  for (int iz = 0; iz < grid.nz; ++iz)
    for (int iy = 0; iy < grid.ny; ++iy)
      for (int ix = 0; ix < grid.nx; ++ix)
        if (const double d = hole_distance(grid, u, w, ix, iy, iz); d > 0) {
          hole[grid.index(ix, iy, iz)] = static_cast<float>(d);
          known[grid.index(ix, iy, iz)] = 1;
        }
  fast_sweep(grid, known, &hole);
  for (std::size_t i = 0; i < u.size(); ++i) u[i] = std::min(u[i], hole[i]) * (w[i] > 0.5f ? -1.f : 1.f);
  return u;
}

}  // namespace sdftrack::sdf
