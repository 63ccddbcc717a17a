// SPDX-License-Identifier: MIT
#include "sdf/mesh_to_sdf.h"

#include <algorithm>
#include <cmath>

#include "base/interrupt.h"
#include "base/parallel.h"
#include "sdf/crossings.h"
#include "sdf/sweep.h"

namespace sdftrack::sdf {

namespace {

constexpr int kBlock = 8;

int blocks(int n) { return (n + kBlock - 1) / kBlock; }

// The exact unsigned distance in one block of voxels, where it is below band_m.
void fill_block(const Bvh& bvh, const Grid& grid, Vec3<int> first, double band_m, std::vector<float>* u,
                std::vector<std::uint8_t>* known) {
  const Vec3<int> last{std::min(first.x + kBlock, grid.nx), std::min(first.y + kBlock, grid.ny),
                       std::min(first.z + kBlock, grid.nz)};
  const Vec3d low = grid.point(first.x, first.y, first.z),
              high = grid.point(last.x - 1, last.y - 1, last.z - 1);
  const double reach = band_m + 0.5 * norm(high - low) + 1e-9 * grid.voxel_m;
  std::int32_t guess = bvh.closest(0.5 * (low + high), reach * reach).face;
  if (guess < 0) return;
  for (int iz = first.z; iz < last.z; ++iz)
    for (int iy = first.y; iy < last.y; ++iy)
      for (int ix = first.x; ix < last.x; ++ix) {
        const Closest c = bvh.closest(grid.point(ix, iy, iz), band_m * band_m, guess);
        if (c.face < 0) continue;
        guess = c.face;  // the next voxel's nearest triangle is usually this one or a neighbour
        const std::size_t i = grid.index(ix, iy, iz);
        (*u)[i] = float(std::sqrt(c.distance2));
        (*known)[i] = 1;
      }
}

}  // namespace

std::vector<float> mesh_distance(const Bvh& bvh, const Grid& grid, double band_vox, int threads) {
  std::vector<float> u(grid.size());
  std::vector<std::uint8_t> known(grid.size(), 0);
  const int bx = blocks(grid.nx), by = blocks(grid.ny), bz = blocks(grid.nz);
  parallel_for(std::size_t(by) * bz, threads, [&](std::size_t chunk) {
    check_interrupt();
    const int iy = int(chunk % std::size_t(by)), iz = int(chunk / std::size_t(by));
    for (int ix = 0; ix < bx; ++ix)
      fill_block(bvh, grid, {ix * kBlock, iy * kBlock, iz * kBlock}, band_vox * grid.voxel_m, &u, &known);
  });
  fast_sweep(grid, known, threads, &u);
  return u;
}

MeshSdf mesh_to_sdf(const MeshView& mesh, const Bvh& bvh, const Grid& grid, double band_vox, int threads) {
  MeshSdf out{mesh_distance(bvh, grid, band_vox, threads), 0};
  const std::vector<std::int8_t> winding = winding_numbers(mesh, grid, threads);
  for (std::size_t i = 0; i < winding.size(); ++i) {
    if (winding[i] > 0) out.phi[i] = -out.phi[i];
    out.inside_out += winding[i] < 0;
  }
  return out;
}

}  // namespace sdftrack::sdf
