// SPDX-License-Identifier: MIT
// A volume on the GPU: distances beyond the band, and what the host asks for.
#pragma once

#include "levelset/device_blocks.cuh"
#include "levelset/far_terms.h"
#include "levelset/free_space_terms.h"
#include "sdf/sweep_terms.h"

namespace sdftrack::levelset {

// Nodes within the band keep their distances, the others are found by rounds of SweepNodes.
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
    if (static_cast<std::size_t>(i) >= lattice.size()) return;
    const int x = i % lattice.nx, y = i / lattice.nx % lattice.ny, z = i / (lattice.nx * lattice.ny);
    const float own = abs(phi[coarse_voxel(grid, x, y, z)]);
    known[i] = own < band_m;
    nodes[i] = other[i] = own < band_m ? own : sdf::kUnreached;
    if (own < band_m) atomicOr(has_surface, 1);
  }
};

// A round of all nodes at once: in the end the same distances as by sweeps in any order.
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
    if (static_cast<std::size_t>(i) >= lattice.size() || known[i]) return;
    const int row = lattice.nx, slice = row * lattice.ny;
    const float a = nearer(i, i % row, lattice.nx, 1), b = nearer(i, i / row % lattice.ny, lattice.ny, row),
                c = nearer(i, i / slice, lattice.nz, slice);
    const float own = from[i];
    float now = own;
    if (least(a, least(b, c)) < own)
      now = least(sdf::godunov(a, b, c, static_cast<float>(lattice.voxel_m)), own);
    to[i] = now;
    if (now < own) atomicOr(changed, 1);
  }

 private:
  // At the border the missing neighbour is replaced by the one inside.
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
    if (static_cast<std::size_t>(i) >= lattice.size()) return;
    const int x = i % lattice.nx, y = i / lattice.nx % lattice.ny, z = i / (lattice.nx * lattice.ny);
    nodes[i] = phi[coarse_voxel(grid, x, y, z)] < 0 ? -from[i] : from[i];
  }
};

struct FillFar {
  static constexpr const char* kName = "far distances: fill";
  static constexpr int kThreads = kThreadsPerVoxels;
  sdf::Grid grid, lattice;
  const float* nodes;
  const int* has_surface;
  float band_m;
  std::size_t first, last;  // voxels
  float* phi;
  __device__ void operator()() const {
    const std::size_t i = first + static_cast<std::size_t>(blockIdx.x) * kThreads + threadIdx.x;
    if (i >= last || !*has_surface) return;
    const float own = phi[i];
    if (abs(own) < band_m) return;
    const auto row = static_cast<std::size_t>(grid.nx), slice = row * static_cast<std::size_t>(grid.ny);
    const CoarsePlace x = coarse_place(static_cast<int>(i % row), lattice.nx),
                      y = coarse_place(static_cast<int>(i % slice / row), lattice.ny),
                      z = coarse_place(static_cast<int>(i / slice), lattice.nz);
    const float there =
        mix(mix_across(nodes, lattice, x.cell, y, z), mix_across(nodes, lattice, x.cell + 1, y, z), x.share);
    phi[i] = far_distance(own, there, band_m);
  }
};

// Those of which the host's copy lacks something, distances in list 0 and colours in list 1; of the former
// also the blocks of layers z0..z1 - 1.
struct NotShown {
  static constexpr const char* kName = "volume: list what has changed";
  BlockLattice blocks;
  const int* shown;
  int z0, z1;
  __device__ bool operator()(int list, int b) const {
    const int z = blocks.z(b);
    return list == 0 ? shown[b] & kPhiNotShown || (z >= z0 && z < z1) : (shown[b] & kColorNotShown) != 0;
  }
};

// The voxels of blocks first.. of a list, one block after another.
template <class T>
struct Gather {
  static constexpr const char* kName = "volume: gather";
  static constexpr int kThreads = kBlockVoxels;
  BlockLattice blocks;
  const int* list;  // from the first of them on
  const T* values;
  T* out;
  __device__ void operator()() const {
    const int b = list[blockIdx.x];
    std::size_t first;
    const BlockRows rows = blocks.rows(b, &first);
    const VoxelPlace at(static_cast<int>(threadIdx.x));
    if (at.x < rows.nx && at.y < rows.ny && at.z < rows.nz)
      out[static_cast<std::size_t>(blockIdx.x) * kBlockVoxels + threadIdx.x] =
          values[first + rows.offset(at.z * rows.ny + at.y) + static_cast<std::size_t>(at.x)];
  }
};

struct LookUp {
  static constexpr const char* kName = "volume: look up";
  static constexpr int kThreads = kThreadsPerVoxels;
  sdf::Grid grid;
  SdfView sdf;
  DeviceVoxels voxels;
  const Vec3f* points;
  int n;
  float near_m;
  float* distance_m;
  unsigned char* past;
  __device__ void operator()() const {
    const int i = global_thread(kThreads);
    if (i >= n) return;
    const Vec3f p = points[i];
    if (!(p.x == p.x)) {
      distance_m[i] = p.x, past[i] = 0;
      return;
    }
    Vec3f unused;
    sample(sdf, p, &distance_m[i], &unused);
    past[i] = looked_past(grid, voxels.phi, voxels.log_ratio, voxels.weight, p.cast<double>(), near_m);
  }
};

}  // namespace sdftrack::levelset
