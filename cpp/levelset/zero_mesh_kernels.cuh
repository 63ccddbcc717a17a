// SPDX-License-Identifier: MIT
// Marching cubes: a block of threads per block of voxels, and a thread per voxel with the three edges and the
// cell that start at it. All numbers follow the order of blocks and voxels, not that of threads.
#pragma once

#include "levelset/device_blocks.cuh"
#include "levelset/marched_voxel.h"

namespace sdftrack::levelset {

// The numbers of vertices and faces before a block, and its place among the blocks that have some.
enum Total { kVertices, kFaces, kSlots, kTotals };
struct BlockPlaces {
  int *vertex, *face, *slot;
  int* blocks;  // by slot
  int* totals;  // Total

  // memory: four numbers per block.
  static BlockPlaces in(int* memory, std::size_t blocks, int* totals) {
    return {memory, memory + blocks, memory + 2 * blocks, memory + 3 * blocks, totals};
  }
};

// The voxel of a thread. All threads of a block read the tile.
__device__ inline MarchedVoxel marched_voxel(const BlockLattice& blocks, int b, const float* phi,
                                             float* tile) {
  for (int k = int(threadIdx.x); k < kTileVoxels; k += kBlockVoxels) tile[k] = tile_value(blocks, b, k, phi);
  __syncthreads();
  return {blocks, b, int(threadIdx.x), tile};
}

// The counts of the voxels, summed over each block.
template <class Count>
struct CountOverBlocks {
  static constexpr const char* kName = Count::kName;
  static constexpr int kThreads = kBlockVoxels;
  BlockLattice blocks;
  const float* phi;
  Count count;
  int* counts;  // by block
  __device__ void operator()() const {
    SDFTRACK_SHARED(float[kTileVoxels], tile);
    SDFTRACK_SHARED(int[kBlockVoxels], all);
    const int b = int(blockIdx.x);
    const MarchedVoxel voxel = marched_voxel(blocks, b, phi, tile);
    const int sum =
        over_block(count(voxel), all, kBlockVoxels, [](int left, int right) { return left + right; });
    if (threadIdx.x == 0) counts[b] = sum;
  }
};

struct CountVertices {
  static constexpr const char* kName = "zero mesh: count";
  const CubeCase* cases;
  __device__ int operator()(const MarchedVoxel& voxel) const { return voxel.counts(cases); }
};

// The sum of the values of all earlier threads; `all` has room for `threads` values.
__device__ inline int sum_before(int own, int* all, int threads) {
  const int t = int(threadIdx.x);
  __syncthreads();
  all[t] = own;
  __syncthreads();
  for (int step = 1; step < threads; step *= 2) {
    const int more = t >= step ? all[t - step] : 0;
    __syncthreads();
    all[t] += more;
    __syncthreads();
  }
  return all[t] - own;
}

// Run by one block of threads; each thread handles some consecutive blocks.
struct PlaceBlocks {
  static constexpr const char* kName = "zero mesh: place blocks";
  static constexpr int kThreads = kThreadsOfList;
  int blocks;
  const int* counts;
  BlockPlaces to;
  __device__ void operator()() const {
    SDFTRACK_SHARED(int[kThreadsOfList], all);
    const int t = int(threadIdx.x), each = (blocks + kThreads - 1) / kThreads,
              first = least(blocks, each * t), last = least(blocks, first + each);
    int own[3] = {0, 0, 0}, at[3];
    for (int b = first; b < last; ++b) add(counts[b], own);
    for (int k = 0; k < 3; ++k) at[k] = sum_before(own[k], all, kThreads);
    if (t == kThreads - 1)
      for (int k = 0; k < 3; ++k) to.totals[k] = at[k] + own[k];
    for (int b = first; b < last; ++b) {
      to.vertex[b] = at[0], to.face[b] = at[1], to.slot[b] = at[2];
      if (counts[b] > 0) to.blocks[at[2]] = b;
      add(counts[b], at);
    }
  }

 private:
  __device__ static void add(int count, int* to_sums) {
    to_sums[0] += vertices_of(count), to_sums[1] += faces_of(count), to_sums[2] += count > 0 ? 1 : 0;
  }
};

struct PlaceVertices {
  static constexpr const char* kName = "zero mesh: vertices";
  static constexpr int kThreads = kBlockVoxels;
  BlockLattice blocks;
  const float* phi;
  BlockPlaces of;
  VoxelVertices* voxels;  // by slot
  Vec3d* vertices;
  __device__ void operator()() const {
    SDFTRACK_SHARED(float[kTileVoxels], tile);
    SDFTRACK_SHARED(int[kBlockVoxels], all);
    const int b = of.blocks[blockIdx.x];
    const MarchedVoxel voxel = marched_voxel(blocks, b, phi, tile);
    const int first = sum_before(voxel.vertices(), all, kThreads);
    voxels[std::size_t(blockIdx.x) * kBlockVoxels + threadIdx.x] = voxel.numbered(first);
    voxel.cut_edges(vertices + of.vertex[b] + first);
  }
};

struct PlaceFaces {
  static constexpr const char* kName = "zero mesh: faces";
  static constexpr int kThreads = kBlockVoxels;
  BlockLattice blocks;
  const float* phi;
  const CubeCase* cases;
  BlockPlaces of;
  const VoxelVertices* voxels;
  std::int32_t* faces;
  __device__ void operator()() const {
    SDFTRACK_SHARED(float[kTileVoxels], tile);
    SDFTRACK_SHARED(int[kBlockVoxels], all);
    const int b = of.blocks[blockIdx.x];
    const MarchedVoxel voxel = marched_voxel(blocks, b, phi, tile);
    const CubeCase& cell = cases[voxel.inside];
    const int triangles = voxel.faces(cases);
    const int first = sum_before(triangles, all, kThreads);
    std::int32_t* const out = faces + 3 * (static_cast<std::int64_t>(of.face[b]) + first);
    for (int k = 0; k < 3 * triangles; ++k) out[k] = vertex_on(voxel, cube_edge(cell.edges[k]));
  }

 private:
  // An edge of the cell starts at the voxel at one of its corners, possibly in another block.
  __device__ std::int32_t vertex_on(const MarchedVoxel& voxel, CubeEdge edge) const {
    const VertexPlace place(blocks, voxel, edge);
    const VoxelVertices own = voxels[std::size_t(of.slot[place.block]) * kBlockVoxels + place.voxel];
    return of.vertex[place.block] + vertex_of(own, edge.axis);
  }
};

}  // namespace sdftrack::levelset
