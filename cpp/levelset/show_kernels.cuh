// SPDX-License-Identifier: MIT
// Transfer of a volume on the GPU to the host: the blocks of which the host's copy is older.
#pragma once

#include <cstdint>

#include "levelset/device_blocks.cuh"

namespace sdftrack::levelset {

// Writes the blocks to their places in the host's memory, without work on the host.
struct ShowBlocks {
  static constexpr const char* kName = "volume: show changed blocks";
  static constexpr int kThreads = 128;
  using Color = std::uint64_t;  // a VoxelColor as one word, for the transfer over the bus
  static_assert(sizeof(Color) == sizeof(VoxelColor));
  BlockLattice blocks;
  int what;  // Shown
  const float* phi;
  const Color* colors;
  float* phi_here;
  Color* colors_here;
  int* shown;
  __device__ void operator()() const {
    for (int b = static_cast<int>(blockIdx.x); b < blocks.count(); b += static_cast<int>(gridDim.x)) {
      const int older = shown[b] & what;
      if (!older) continue;
      std::size_t first;
      const BlockRows rows = blocks.rows(b, &first);
      for (int i = static_cast<int>(threadIdx.x); i < kBlockVoxels; i += kThreads) {
        const VoxelPlace at(i);
        if (at.x >= rows.nx || at.y >= rows.ny || at.z >= rows.nz) continue;
        const std::size_t voxel = first + rows.offset(at.z * rows.ny + at.y) + static_cast<std::size_t>(at.x);
        if (older & kPhiNotShown) phi_here[voxel] = phi[voxel];
        if (older & kColorNotShown) colors_here[voxel] = colors[voxel];
      }
      __syncthreads();  // each thread has read the present mark
      if (threadIdx.x == 0) shown[b] &= ~what;
    }
  }
};

}  // namespace sdftrack::levelset
