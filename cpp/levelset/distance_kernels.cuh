// SPDX-License-Identifier: MIT
// The distances on the GPU, in the order of distance.cpp: the same bits if the evidence has the same bits.
#pragma once

#include "levelset/device_blocks.cuh"

namespace sdftrack::levelset {

struct FillSides {
  static constexpr const char* kName = "distances: sides";
  static constexpr int kThreads = kThreadsPerVoxels;
  const float* log_ratio;
  float far_m;
  std::size_t n;
  float* phi;
  __device__ void operator()() const {
    const std::size_t i = std::size_t(blockIdx.x) * kThreads + threadIdx.x;
    if (i < n) phi[i] = log_ratio[i] > 0 ? -far_m : far_m;
  }
};

// A block without a surface and without a turned voxel has gained no surface. A change in a block also moves
// the surface between it and the voxels on the other side of its faces.
struct FindRoles {
  static constexpr const char* kName = "distances: roles of blocks";
  static constexpr int kThreads = kThreadsPerBlocks;
  BlockLattice blocks;
  DeviceBlocks of;
  bool all;
  __device__ void operator()() const {
    const int b = global_thread(kThreads);
    if (b >= blocks.count()) return;
    const int x = blocks.x(b), y = blocks.y(b), z = blocks.z(b);
    const bool beside = (x > 0 && changed(blocks.at(x - 1, y, z))) ||
                        (x + 1 < blocks.bx && changed(blocks.at(x + 1, y, z))) ||
                        (y > 0 && changed(blocks.at(x, y - 1, z))) ||
                        (y + 1 < blocks.by && changed(blocks.at(x, y + 1, z))) ||
                        (z > 0 && changed(blocks.at(x, y, z - 1))) ||
                        (z + 1 < blocks.bz && changed(blocks.at(x, y, z + 1)));
    of.role[b] = changed(b) ? kChanged : beside ? kBeside : kUntouched;
  }

 private:
  __device__ bool changed(int b) const { return all || (of.touched[b] && (of.surface[b] || of.turned[b])); }
};

struct CrossBlocks {
  static constexpr const char* kName = "distances: beside the surface";
  static constexpr int kThreads = kBlockVoxels;
  BlockLattice blocks;
  DeviceVoxels voxels;
  DeviceBlocks of;
  BlockList list;
  float voxel_m;
  __device__ void operator()() const {
    SDFTRACK_SHARED(SurfaceChange[kBlockVoxels], changes);
    SDFTRACK_SHARED(int, found);
    const int t = int(threadIdx.x);
    for (int k = int(blockIdx.x); k < *list.count; k += int(gridDim.x)) {
      const int b = list.blocks[k];
      if (t == 0) found = 0;
      __syncthreads();
      SurfaceChange own{};
      if (const int own_found = cross(b, VoxelPlace(t), &own)) atomicOr(&found, own_found);
      __syncthreads();
      const bool surface = found & kCrossed, whole = of.role[b] == kChanged;
      if (whole && surface)
        own = over_block(own, changes, kBlockVoxels, [](const SurfaceChange& a, const SurfaceChange& b) {
          return SurfaceChange{a.sum_m + b.sum_m, most(a.max_m, b.max_m), a.count + b.count};
        });
      if (t == 0) {
        if (whole) of.change[b] = own, of.surface[b] = surface;
        if (surface) of.surface[b] = 1;
        if (found & kOther) of.shown[b] |= kPhiNotShown;
      }
      __syncthreads();
    }
  }

 private:
  // In a block that is only a neighbour, the voxels on a face to a changed block.
  __device__ bool concerns(int b, int x, int y, int z) const {
    if (of.role[b] == kChanged) return true;
    const int bx = blocks.x(b), by = blocks.y(b), bz = blocks.z(b), last = kBlockSide - 1;
    const auto changed = [&](int dx, int dy, int dz) {
      return of.role[blocks.at(bx + dx, by + dy, bz + dz)] == kChanged;
    };
    return (x % kBlockSide == 0 && bx > 0 && changed(-1, 0, 0)) ||
           (x % kBlockSide == last && bx + 1 < blocks.bx && changed(1, 0, 0)) ||
           (y % kBlockSide == 0 && by > 0 && changed(0, -1, 0)) ||
           (y % kBlockSide == last && by + 1 < blocks.by && changed(0, 1, 0)) ||
           (z % kBlockSide == 0 && bz > 0 && changed(0, 0, -1)) ||
           (z % kBlockSide == last && bz + 1 < blocks.bz && changed(0, 0, 1));
  }
  enum Found { kCrossed = 1, kOther = 2 };  // the surface; a changed distance
  __device__ int cross(int b, const VoxelPlace& at, SurfaceChange* change) const {
    const VoxelRange r = blocks.inner(b);
    const int x = kBlockSide * blocks.x(b) + at.x, y = kBlockSide * blocks.y(b) + at.y,
              z = kBlockSide * blocks.z(b) + at.z;
    if (x < r.x0 || x >= r.x1 || y < r.y0 || y >= r.y1 || z < r.z0 || z >= r.z1) return 0;
    if (!concerns(b, x, y, z)) return 0;
    const std::size_t row = std::size_t(blocks.grid.nx), slice = row * std::size_t(blocks.grid.ny),
                      i = blocks.grid.index(x, y, z);
    const float* const p = voxels.log_ratio + i;
    const float *const y0 = p - row, *const y1 = p + row, *const z0 = p - slice, *const z1 = p + slice;
    float* const phi = voxels.phi + i;
    const float before = *phi;
    const Sided<float> side =
        sided(*p, least(least(least(p[-1], p[1]), least(*y0, *y1)), least(*z0, *z1)),
              most(most(most(p[-1], p[1]), most(*y0, *y1)), most(*z0, *z1)), *phi, voxel_m);
    *phi = side.phi;
    if (!side.crossed) return side.phi != before ? kOther : 0;
    const float now = crossing_distance({voxels.log_ratio, voxels.weight}, i, row, slice, voxel_m),
                moved = abs(now - side.phi);
    if (abs(side.phi) < kMoveWithin * voxel_m) change->sum_m = moved, change->count = 1;
    change->max_m = moved;
    *phi = now;
    return now != before ? kCrossed | kOther : kCrossed;
  }
};

struct HasRole {
  static constexpr const char* kName = "distances: list blocks with a surface that may have moved";
  const unsigned char* role;
  __device__ bool operator()(int, int b) const { return role[b] != kUntouched; }
};

// The mean motion over all changed blocks.
struct AddChanges {
  static constexpr const char* kName = "distances: change";
  static constexpr int kThreads = kThreadsPerVoxels;
  DeviceBlocks of;
  BlockList list;
  double* mean_m;
  __device__ void operator()() const {
    SDFTRACK_SHARED(double[kThreadsPerVoxels], sums);
    SDFTRACK_SHARED(int[kThreadsPerVoxels], counts);
    double sum = 0;
    int count = 0;
    for (int k = int(threadIdx.x); k < *list.count; k += kThreads) {
      const int b = list.blocks[k];
      if (of.role[b] == kChanged) sum += double(of.change[b].sum_m), count += of.change[b].count;
    }
    sum = over_block(sum, sums, kThreads, [](double a, double b) { return a + b; });
    count = over_block(count, counts, kThreads, [](int a, int b) { return a + b; });
    if (threadIdx.x == 0) *mean_m = count > 0 ? sum / count : 0;
  }
};

// Finds the blocks where the surface has moved, or where distances are still affected by an earlier motion.
struct FindSources {
  static constexpr const char* kName = "distances: what moved";
  static constexpr int kThreads = kThreadsPerBlocks;
  int blocks;
  DeviceBlocks of;
  float min_m;
  __device__ void operator()() const {
    const int b = global_thread(kThreads);
    if (b >= blocks) return;
    bool source = of.unsettled[b];
    if (of.role[b] == kChanged) {
      const float moved_m = of.moved_m[b] + of.change[b].max_m;
      const bool follows = !(moved_m < min_m) || of.turned[b];
      of.moved_m[b] = follows ? 0 : moved_m;
      source |= follows;
    }
    of.source[b] = source;
  }
};

// Marks the sources and the blocks around them, if the surface runs through the block or a neighbour: these
// blocks contain everything within a block's width of the surface.
struct MarkBlocks {
  static constexpr const char* kName = "distances: mark";
  static constexpr int kThreads = kThreadsPerBlocks;
  BlockLattice blocks;
  DeviceBlocks of;
  __device__ void operator()() const {
    const int b = global_thread(kThreads);
    if (b >= blocks.count()) return;
    bool marked = false, surface = false;
    const VoxelRange r = blocks.around(b);
    for (int z = r.z0; z < r.z1; ++z)
      for (int y = r.y0; y < r.y1; ++y)
        for (int x = r.x0; x < r.x1; ++x) {
          const int other = blocks.at(x, y, z);
          marked |= of.source[other] != 0, surface |= of.surface[other] != 0;
        }
    of.marked[b] = !marked ? kNotMarked : surface ? kFollows : kFollowsIfNear;
  }
};

struct MayBeNear {
  static constexpr const char* kName = "distances: list blocks that may be near";
  const unsigned char* marked;
  __device__ bool operator()(int, int b) const { return marked[b] == kFollowsIfNear; }
};

struct FindNear {
  static constexpr const char* kName = "distances: near";
  static constexpr int kThreads = kBlockVoxels;
  BlockLattice blocks;
  const float* phi;
  DeviceBlocks of;
  BlockList list;
  float band_m;
  __device__ void operator()() const {
    SDFTRACK_SHARED(float[kBlockVoxels], all);
    const VoxelPlace at(int(threadIdx.x));
    for (int k = int(blockIdx.x); k < *list.count; k += int(gridDim.x)) {
      const int b = list.blocks[k];
      const VoxelRange r = blocks.inner(b);
      const int x = kBlockSide * blocks.x(b) + at.x, y = kBlockSide * blocks.y(b) + at.y,
                z = kBlockSide * blocks.z(b) + at.z;
      const bool in = x >= r.x0 && x < r.x1 && y >= r.y0 && y < r.y1 && z >= r.z0 && z < r.z1;
      const float nearest = over_block(in ? abs(phi[blocks.grid.index(x, y, z)]) : kMax_m, all, kBlockVoxels,
                                       [](float a, float b) { return least(a, b); });
      if (threadIdx.x == 0) {
        const bool near = nearest < band_m;
        of.marked[b] = near ? kFollows : kNotMarked;
        if (!near) of.unsettled[b] = 0;
      }
      __syncthreads();
    }
  }
};

struct FollowsInColor {
  static constexpr const char* kName = "distances: list blocks by colour";
  BlockLattice blocks;
  const unsigned char* marked;
  __device__ bool operator()(int color, int b) const {
    return marked[b] == kFollows && blocks.color(b) == color;
  }
};

// A sweep over each block of a list in which no two blocks are neighbours. A row follows the rows before it
// along y and z; rows that do not depend on each other run in parallel.
struct RelaxBlocks {
  static constexpr const char* kName = "distances: relax";
  static constexpr int kThreads = kBlockSide * kBlockSide;
  static constexpr int kSide = kBlockSide + 2;  // with the neighbouring voxels
  BlockLattice blocks;
  EikonalTerm<float> term;
  DeviceBlocks of;
  BlockList list;
  bool forward;
  float settled_m, band_m;
  float* phi;
  __device__ void operator()() const {
    SDFTRACK_SHARED(float[kSide * kSide * kSide], tile);
    SDFTRACK_SHARED(int, changed);
    for (int k = int(blockIdx.x); k < *list.count; k += int(gridDim.x)) {
      const int b = list.blocks[k];
      const VoxelRange r = blocks.inner(b);
      const int nx = r.x1 - r.x0, ny = r.y1 - r.y0, nz = r.z1 - r.z0;
      if (threadIdx.x == 0) changed = 0;
      for (int i = int(threadIdx.x); i < kSide * kSide * kSide; i += kThreads) {
        const int x = i % kSide, y = i / kSide % kSide, z = i / (kSide * kSide);
        if (nx > 0 && ny > 0 && nz > 0 && x < nx + 2 && y < ny + 2 && z < nz + 2)
          tile[i] = phi[blocks.grid.index(r.x0 - 1 + x, r.y0 - 1 + y, r.z0 - 1 + z)];
      }
      __syncthreads();
      if (const int own = sweep(nx, ny, nz, tile)) atomicOr(&changed, own);
      __syncthreads();
      for (int i = int(threadIdx.x); i < kBlockVoxels; i += kThreads) {
        const VoxelPlace at(i);
        if (at.x < nx && at.y < ny && at.z < nz)
          phi[blocks.grid.index(r.x0 + at.x, r.y0 + at.y, r.z0 + at.z)] =
              tile[((at.z + 1) * kSide + at.y + 1) * kSide + at.x + 1];
      }
      if (threadIdx.x == 0) {
        of.unsettled[b] = (changed & kMovedOn) != 0;
        if (changed) of.shown[b] |= kPhiNotShown;
      }
      __syncthreads();
    }
  }

 private:
  enum Swept { kOther = 1, kMovedOn = 2 };  // a thread's voxel has changed; by more than settled_m
  __device__ int sweep(int nx, int ny, int nz, float* tile) const {
    const int x = int(threadIdx.x) % kBlockSide, line = int(threadIdx.x) / kBlockSide;
    int swept = 0;
    for (int front = 0; front < 2 * kBlockSide - 1; ++front) {
      const int rank = front - line;
      const bool here = x < nx && line < ny && rank >= 0 && rank < nz;
      const int y = forward ? line : ny - 1 - line, z = forward ? rank : nz - 1 - rank;
      float* const row = tile + ((z + 1) * kSide + y + 1) * kSide + 1;
      float now = 0;
      if (here) {
        now = term.relax({row, kSide, kSide * kSide}, x, 1);
        if (now != row[x]) swept |= kOther;
        if (abs(now - row[x]) > settled_m && abs(now) < band_m) swept |= kMovedOn;
      }
      __syncthreads();
      if (here) row[x] = now;
      __syncthreads();
    }
    return swept;
  }
};

}  // namespace sdftrack::levelset
