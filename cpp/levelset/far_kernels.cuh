// SPDX-License-Identifier: MIT
// Distances beyond the band on the GPU.
#pragma once

#include "levelset/device_blocks.cuh"
#include "levelset/far_terms.h"
#include "sdf/sweep_terms.h"

namespace sdftrack::levelset {

// Nodes within the band keep their distances; rounds of SweepNodes find the others.
struct StartNodes {
  static constexpr const char* kName = "far distances: start";
  static constexpr int kThreads = kThreadsPerVoxels;
  sdf::Grid grid, lattice;
  const float* phi;
  float band_m;
  float *nodes, *other;  // two copies
  unsigned char* known;
  int* has_surface;
  __device__ void operator()() const {
    const int i = global_thread(kThreads);
    if (std::size_t(i) >= lattice.size()) return;
    const int x = i % lattice.nx, y = i / lattice.nx % lattice.ny, z = i / (lattice.nx * lattice.ny);
    const float own = abs(phi[coarse_voxel(grid, x, y, z)]);
    known[i] = own < band_m;
    nodes[i] = other[i] = own < band_m ? own : sdf::kUnreached;
    if (own < band_m) atomicOr(has_surface, 1);
  }
};

// One round over all nodes at once. It converges to the same distances as sweeps in any order.
struct SweepNodes {
  static constexpr const char* kName = "far distances: sweep";
  static constexpr int kThreads = kThreadsPerVoxels;
  sdf::Grid lattice;
  const unsigned char* known;
  const float* from;
  float* to;
  int* changed;
  __device__ void operator()() const {
    const int i = global_thread(kThreads);
    if (std::size_t(i) >= lattice.size() || known[i]) return;
    const int row = lattice.nx, slice = row * lattice.ny;
    const float a = nearer(i, i % row, lattice.nx, 1), b = nearer(i, i / row % lattice.ny, lattice.ny, row),
                c = nearer(i, i / slice, lattice.nz, slice);
    const float own = from[i];
    float now = own;
    if (least(a, least(b, c)) < own) now = least(sdf::godunov(a, b, c, float(lattice.voxel_m)), own);
    to[i] = now;
    if (now < own) atomicOr(changed, 1);
  }

 private:
  // At the border the inner neighbour replaces the missing one.
  __device__ float nearer(int i, int place, int n, int step) const {
    return least(from[place > 0 ? i - step : i + step], from[place + 1 < n ? i + step : i - step]);
  }
};

struct SignNodes {
  static constexpr const char* kName = "far distances: signs";
  static constexpr int kThreads = kThreadsPerVoxels;
  sdf::Grid grid, lattice;
  const float *phi, *from;
  float* nodes;
  __device__ void operator()() const {
    const int i = global_thread(kThreads);
    if (std::size_t(i) >= lattice.size()) return;
    const int x = i % lattice.nx, y = i / lattice.nx % lattice.ny, z = i / (lattice.nx * lattice.ny);
    nodes[i] = phi[coarse_voxel(grid, x, y, z)] < 0 ? -from[i] : from[i];
  }
};

// Fills the voxels beyond the band and marks the blocks in which a distance has changed.
struct FillFar {
  static constexpr const char* kName = "far distances: fill";
  static constexpr int kThreads = kThreadsPerVoxels;
  BlockLattice blocks;
  sdf::Grid lattice;
  const float* nodes;
  const int* has_surface;
  float band_m;
  std::size_t first, last;  // voxels
  float* phi;
  int* shown;
  __device__ void operator()() const {
    const std::size_t i = first + std::size_t(blockIdx.x) * kThreads + threadIdx.x;
    if (i >= last || !*has_surface) return;
    const float own = phi[i];
    if (abs(own) < band_m) return;
    const sdf::Grid& grid = blocks.grid;
    const auto row = std::size_t(grid.nx), slice = row * std::size_t(grid.ny);
    const int vx = int(i % row), vy = int(i % slice / row), vz = int(i / slice);
    const CoarsePlace x = coarse_place(vx, lattice.nx), y = coarse_place(vy, lattice.ny),
                      z = coarse_place(vz, lattice.nz);
    const float there =
        mix(mix_across(nodes, lattice, x.cell, y, z), mix_across(nodes, lattice, x.cell + 1, y, z), x.share);
    const float now = far_distance(own, there, band_m);
    if (now == own) return;
    phi[i] = now;
    int* const noted = shown + blocks.at(vx / kBlockSide, vy / kBlockSide, vz / kBlockSide);
    if (!(*noted & kPhiNotShown)) atomicOr(noted, kPhiNotShown);
  }
};

}  // namespace sdftrack::levelset
