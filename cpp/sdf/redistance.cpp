// SPDX-License-Identifier: MIT
#include "sdf/redistance.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "base/parallel.h"
#include "sdf/closest_zero.h"
#include "sdf/sweep.h"

namespace sdftrack {

namespace {

constexpr float kRefinedVoxels = 4;

// Distance to the surface from its crossings of the grid lines through one voxel: the plane through them.
// 0 when no neighbour has the other sign.
double crossing_distance(const Grid& grid, const float* phi, int ix, int iy, int iz) {
  const std::size_t i = grid.index(ix, iy, iz);
  const int at[3] = {ix, iy, iz}, count[3] = {grid.nx, grid.ny, grid.nz};
  const std::size_t stride[3] = {1, static_cast<std::size_t>(grid.nx), grid.index(0, 0, 1)};
  const double here = phi[i];
  double inverse2 = 0;
  for (int axis = 0; axis < 3; ++axis) {
    double nearest = 2;
    for (int side : {-1, 1}) {
      if (at[axis] + side < 0 || at[axis] + side >= count[axis]) continue;
      const double there = phi[side < 0 ? i - stride[axis] : i + stride[axis]];
      if ((there < 0) != (here < 0)) nearest = std::min(nearest, std::abs(here) / std::abs(here - there));
    }
    if (nearest <= 1) inverse2 += 1 / std::max(nearest * nearest, 1e-12);
  }
  return inverse2 > 0 ? grid.voxel_m / std::sqrt(inverse2) : 0;
}

Vec3d slope(const Grid& grid, const std::vector<float>& u, int ix, int iy, int iz) {
  const auto axis = [&](int at, int n, std::size_t stride) {
    const std::size_t i = grid.index(ix, iy, iz);
    const float here = u[i], low = at > 0 ? u[i - stride] : here, high = at + 1 < n ? u[i + stride] : here;
    // Upwind: the surface lies on the side of the smaller neighbour.
    return low < high ? static_cast<double>(here - low) : static_cast<double>(high - here);
  };
  return {axis(ix, grid.nx, 1), axis(iy, grid.ny, static_cast<std::size_t>(grid.nx)),
          axis(iz, grid.nz, grid.index(0, 0, 1))};
}

// Where the swept field says that the surface is near: the distance to the nearest point of the zero set.
void refine(const Grid& grid, const float* phi, const std::vector<float>& swept, int iz,
            std::vector<float>* u, std::vector<std::uint8_t>* known) {
  const SdfView sdf = grid.view(phi);
  for (int iy = 0; iy < grid.ny; ++iy)
    for (int ix = 0; ix < grid.nx; ++ix) {
      const std::size_t i = grid.index(ix, iy, iz);
      if (!(swept[i] < kRefinedVoxels * static_cast<float>(grid.voxel_m))) continue;
      const Vec3d p = grid.point(ix, iy, iz);
      Vec3d down = slope(grid, swept, ix, iy, iz), start = p, zero;
      // Next to the surface the unsigned field has its kink: there the Newton steps start at the voxel
      // itself.
      const double length = norm(down);
      if (!(*known)[i] && length > 0) start = p - (swept[i] / length) * down;
      if (!closest_zero(sdf, p, start, &zero)) continue;
      const double distance = norm(p - zero);
      if (std::abs(distance - swept[i]) > grid.voxel_m) continue;
      (*u)[i] = static_cast<float>(distance);
      (*known)[i] = 1;
    }
}

}  // namespace

std::vector<float> redistance(const Grid& grid, const float* phi, int threads) {
  std::vector<float> u(grid.size(), 0.f);
  std::vector<std::uint8_t> known(grid.size(), 0);
  parallel_for(static_cast<std::size_t>(grid.nz), threads, [&](std::size_t chunk) {
    const int iz = static_cast<int>(chunk);
    for (int iy = 0; iy < grid.ny; ++iy)
      for (int ix = 0; ix < grid.nx; ++ix) {
        const double d = crossing_distance(grid, phi, ix, iy, iz);
        if (!(d > 0) && phi[grid.index(ix, iy, iz)] != 0) continue;
        u[grid.index(ix, iy, iz)] = static_cast<float>(d);
        known[grid.index(ix, iy, iz)] = 1;
      }
  });
  if (std::find(known.begin(), known.end(), 1) == known.end())
    throw std::invalid_argument(
        "values: expected a field with negative (inside) and positive (outside) values, "
        "got one sign only; there is no surface to measure from");
  fast_sweep(grid, known, &u);
  const std::vector<float> swept = u;
  parallel_for(static_cast<std::size_t>(grid.nz), threads,
               [&](std::size_t iz) { refine(grid, phi, swept, static_cast<int>(iz), &u, &known); });
  fast_sweep(grid, known, &u);
  for (std::size_t i = 0; i < u.size(); ++i)
    if (phi[i] < 0) u[i] = -u[i];
  return u;
}

}  // namespace sdftrack
