// SPDX-License-Identifier: MIT
// What the host asks for of a volume on the GPU: the blocks of which its copy is older.
#pragma once

#include "levelset/device_blocks.cuh"

namespace sdftrack::levelset {

// Of distances also the blocks of layers z0..z1 - 1.
struct PhiNotShown {
  static constexpr const char* kName = "volume: list changed distances";
  BlockLattice blocks;
  const int* shown;
  int z0, z1;
  __device__ bool operator()(int, int b) const {
    const int z = blocks.z(b);
    return shown[b] & kPhiNotShown || (z >= z0 && z < z1);
  }
};

struct ColorNotShown {
  static constexpr const char* kName = "volume: list changed colours";
  const int* shown;
  __device__ bool operator()(int, int b) const { return (shown[b] & kColorNotShown) != 0; }
};

// The host has this of all blocks from now on.
struct NoteShown {
  static constexpr const char* kName = "volume: note what is shown";
  static constexpr int kThreads = kThreadsPerBlocks;
  int blocks, what;
  int* shown;
  __device__ void operator()() const {
    const int b = global_thread(kThreads);
    if (b < blocks) shown[b] &= ~what;
  }
};

// The voxels of blocks first.. of a list, one block after another; 0 beyond the volume.
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
    const bool in = at.x < rows.nx && at.y < rows.ny && at.z < rows.nz;
    out[static_cast<std::size_t>(blockIdx.x) * kBlockVoxels + threadIdx.x] =
        in ? values[first + rows.offset(at.z * rows.ny + at.y) + static_cast<std::size_t>(at.x)] : T{};
  }
};

}  // namespace sdftrack::levelset
