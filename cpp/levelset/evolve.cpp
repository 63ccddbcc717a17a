// SPDX-License-Identifier: MIT
#include "levelset/evolve.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "base/interrupt.h"
#include "base/parallel.h"
#include "levelset/voxel_ops.h"

namespace sdftrack::levelset {

namespace {

// Calls body(at, i, count) for the voxels of a slice, in runs with neighbours at the same offsets.
template <class Body>
void each_run(const sdf::Grid& grid, int z, const Body& body) {
  Neighbours at[3];
  at[2] = neighbours(z, grid.nz, grid.nx * grid.ny);
  for (int y = 0; y < grid.ny; ++y) {
    at[1] = neighbours(y, grid.ny, grid.nx);
    const auto run = [&](int x, int count) {
      at[0] = neighbours(x, grid.nx, 1);
      body(at, grid.index(x, y, z), count);
    };
    run(0, 1);
    if (grid.nx > 2) run(1, grid.nx - 2);
    run(grid.nx - 1, 1);
  }
}

}  // namespace

void check_evolution(const EvolveOptions& o, int steps) {
  for (const float x : {o.sigma_h, o.sigma_phi, o.dt})
    if (!(x > 0) || !std::isfinite(x))
      throw std::invalid_argument("sigma_h, sigma_phi, dt: expected positive numbers");
  const float most = longest_step(o);
  if (!(o.dt <= most))
    throw std::invalid_argument("dt: expected at most " + std::to_string(most) +
                                " for this sigma_h and sigma_phi (stability limit of the evolution), got " +
                                std::to_string(o.dt));
  if (steps < 0) throw std::invalid_argument("steps: expected at least 0, got " + std::to_string(steps));
}

// 2 over a bound of the energy's curvature: 12 mu of the Laplacian in three dimensions (the potentials'
// curvature only reduces it) and 1 / (4 sigma_h^2) of the data term.
float longest_step(const EvolveOptions& o) {
  return 2 / (12 / (o.sigma_phi * o.sigma_phi) + 1 / (4 * o.sigma_h * o.sigma_h));
}

std::vector<float> evolve(const sdf::Grid& grid, const float* phi_m, const float* log_ratio, int steps,
                          const EvolveOptions& options, int threads) {
  check_evolution(options, steps);
  const VoxelOps& ops = for_isa<VoxelOps>(used_isa());
  const EvolveTerm<float> term{1 / options.sigma_h, 1 / (options.sigma_phi * options.sigma_phi), options.dt,
                               options.printed};
  const auto voxel_m = float(grid.voxel_m);
  std::vector<float> phi(phi_m, phi_m + grid.size());
  if (steps == 0) return phi;
  for (float& x : phi) x /= voxel_m;
  std::vector<float> next(grid.size()), flux[3];
  for (std::vector<float>& f : flux) f.resize(grid.size());
  const auto slices = std::size_t(grid.nz);
  for (int step = 0; step < steps; ++step) {
    check_interrupt();
    parallel_for(slices, threads, [&](std::size_t z) {
      each_run(grid, int(z), [&](const Neighbours* at, std::size_t i, int count) {
        float* const out[3] = {&flux[0][i], &flux[1][i], &flux[2][i]};
        ops.flux(term, at, &phi[i], count, out);
      });
    });
    parallel_for(slices, threads, [&](std::size_t z) {
      each_run(grid, int(z), [&](const Neighbours* at, std::size_t i, int count) {
        const float* const from[3] = {&flux[0][i], &flux[1][i], &flux[2][i]};
        ops.step(term, at, &phi[i], log_ratio + i, from, count, &next[i]);
      });
    });
    phi.swap(next);
  }
  for (float& x : phi) x *= voxel_m;
  return phi;
}

}  // namespace sdftrack::levelset
