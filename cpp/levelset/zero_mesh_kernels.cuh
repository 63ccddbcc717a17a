// SPDX-License-Identifier: MIT
// Marching cubes: a block of threads for each block of voxels, a thread for a voxel, the three edges and the
// cell that begin there. All numbers follow the order of blocks and voxels, not that of threads.
#pragma once

#include "levelset/cube_cases.h"
#include "levelset/device_blocks.cuh"

namespace sdftrack::levelset {

constexpr int kTileSide = kBlockSide + 1, kTileVoxels = kTileSide * kTileSide * kTileSide;

// What is counted of a block and of a voxel: vertices, and faces in the upper half.
constexpr int kOneFace = 1 << 16;
HD int vertices_of(int packed) { return packed % kOneFace; }
HD int faces_of(int packed) { return packed / kOneFace; }

// The edges that begin at a voxel and are cut, a bit for each axis.
HD int cut_edges_before(int edges, int axis) {
  const int before = edges & ((1 << axis) - 1);
  return (before & 1) + (before >> 1 & 1);
}

// A block's vertices and faces before it, and its place among the blocks that have some.
enum Total { kVertices, kFaces, kSlots, kTotals };
struct BlockPlaces {
  int *vertex, *face, *slot;
  int* blocks;  // by slot
  int* totals;  // Total

  // memory: four numbers for each block.
  static BlockPlaces in(int* memory, std::size_t blocks, int* totals) {
    return {memory, memory + blocks, memory + 2 * blocks, memory + 3 * blocks, totals};
  }
};

// The voxel of a thread, in a tile of its block and the voxels behind it.
struct MarchedVoxel {
  int x, y, z;  // in the volume
  int edges = 0, inside = 0;
  bool has_cell = false;
  const float* at;

  // All threads of a block: reads the tile.
  __device__ MarchedVoxel(const BlockLattice& blocks, int b, const float* phi, float* tile) {
    const sdf::Grid& grid = blocks.grid;
    const int x0 = kBlockSide * blocks.x(b), y0 = kBlockSide * blocks.y(b), z0 = kBlockSide * blocks.z(b);
    // Beyond the volume its last voxels, from which the surface does not part them.
    for (int k = static_cast<int>(threadIdx.x); k < kTileVoxels; k += kBlockVoxels)
      tile[k] = phi[grid.index(least(grid.nx - 1, x0 + k % kTileSide),
                               least(grid.ny - 1, y0 + k / kTileSide % kTileSide),
                               least(grid.nz - 1, z0 + k / (kTileSide * kTileSide)))];
    __syncthreads();
    const VoxelPlace place(static_cast<int>(threadIdx.x));
    x = x0 + place.x, y = y0 + place.y, z = z0 + place.z;
    at = tile + (place.z * kTileSide + place.y) * kTileSide + place.x;
    if (x >= grid.nx || y >= grid.ny || z >= grid.nz) return;
    has_cell = x + 1 < grid.nx && y + 1 < grid.ny && z + 1 < grid.nz;
    for (int corner = 0; corner < 8; ++corner) inside |= is_inside(value(corner)) ? 1 << corner : 0;
    for (int axis = 0; axis < 3; ++axis)
      if ((inside & 1) != (inside >> (1 << axis) & 1)) edges |= 1 << axis;
  }
  __device__ float value(int corner) const {
    return at[((corner >> 2) * kTileSide + (corner >> 1 & 1)) * kTileSide + (corner & 1)];
  }
  __device__ int counts(const CubeCase* cases) const {
    return cut_edges_before(edges, 2) + (edges >> 2) + (has_cell ? cases[inside].triangles * kOneFace : 0);
  }
};

// What each voxel counts, summed over its block.
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
    const int b = static_cast<int>(blockIdx.x);
    const MarchedVoxel voxel(blocks, b, phi, tile);
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

// The sum of what the threads before have; `all` has room for each of the `threads`.
__device__ inline int sum_before(int own, int* all, int threads) {
  const int t = static_cast<int>(threadIdx.x);
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

// By one block of threads, of which each has some blocks one after another.
struct PlaceBlocks {
  static constexpr const char* kName = "zero mesh: place blocks";
  static constexpr int kThreads = kThreadsOfList;
  int blocks;
  const int* counts;
  BlockPlaces to;
  __device__ void operator()() const {
    SDFTRACK_SHARED(int[kThreadsOfList], all);
    const int t = static_cast<int>(threadIdx.x), each = (blocks + kThreads - 1) / kThreads,
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

// Of a voxel: its first vertex among those of its block, and in the last three bits its edges.
using VoxelVertices = std::uint16_t;

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
    const MarchedVoxel voxel(blocks, b, phi, tile);
    const int first = sum_before(cut_edges_before(voxel.edges, 2) + (voxel.edges >> 2), all, kThreads);
    voxels[static_cast<std::size_t>(blockIdx.x) * kBlockVoxels + threadIdx.x] =
        static_cast<VoxelVertices>(first << 3 | voxel.edges);
    Vec3d* out = vertices + of.vertex[b] + first;
    for (int axis = 0; axis < 3; ++axis) {
      if ((voxel.edges >> axis & 1) == 0) continue;
      const double cut = cut_between(voxel.value(0), voxel.value(1 << axis));
      *out++ = {voxel.x + (axis == 0 ? cut : 0.0), voxel.y + (axis == 1 ? cut : 0.0),
                voxel.z + (axis == 2 ? cut : 0.0)};
    }
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
    const MarchedVoxel voxel(blocks, b, phi, tile);
    const CubeCase& cell = cases[voxel.inside];
    const int triangles = voxel.has_cell ? cell.triangles : 0;
    const int first = sum_before(triangles, all, kThreads);
    std::int32_t* const out = faces + 3 * (static_cast<std::int64_t>(of.face[b]) + first);
    for (int k = 0; k < 3 * triangles; ++k) out[k] = vertex_on(voxel, cube_edge(cell.edges[k]));
  }

 private:
  // An edge of the cell begins at the voxel at one of its corners, perhaps of another block.
  __device__ std::int32_t vertex_on(const MarchedVoxel& voxel, CubeEdge edge) const {
    const int x = voxel.x + (edge.corner & 1), y = voxel.y + (edge.corner >> 1 & 1),
              z = voxel.z + (edge.corner >> 2);
    const int b = blocks.at(x / kBlockSide, y / kBlockSide, z / kBlockSide);
    const int place = ((z % kBlockSide) * kBlockSide + y % kBlockSide) * kBlockSide + x % kBlockSide;
    const int own =
        voxels[static_cast<std::size_t>(of.slot[b]) * kBlockVoxels + static_cast<std::size_t>(place)];
    return of.vertex[b] + (own >> 3) + cut_edges_before(own & 7, edge.axis);
  }
};

}  // namespace sdftrack::levelset
