// SPDX-License-Identifier: MIT
// Numbers in the order of the image on the device. The last block to finish adds up the counts of all.
#pragma once

#include "superpixels/slic_regions.cuh"

namespace sdftrack::superpixels {

// Whether all other blocks of the grid have finished; to be called by all threads of a block.
__device__ inline bool is_last_block(SlicCounters* counters) {
  SDFTRACK_SHARED(bool, last);
  __threadfence();
  __syncthreads();
  if (threadIdx.x == 0) {
    last = atomicAdd(&counters->blocks_done, 1u) == gridDim.x - 1;
    if (last) counters->blocks_done = 0;
    __threadfence();
  }
  __syncthreads();
  return last;
}

// Replaces each count by the sum of those before it. Each thread of the block adds up a section.
__device__ inline void add_up(volatile int* counts, int n, int* total) {
  SDFTRACK_SHARED(int[kBlockThreads], sums);
  const int me = static_cast<int>(threadIdx.x), each = (n + kBlockThreads - 1) / kBlockThreads;
  const int first = me * each < n ? me * each : n, last = first + each < n ? first + each : n;
  int own = 0;
  for (int i = first; i < last; ++i) own += counts[i];
  sums[me] = own;
  __syncthreads();
  for (int reach = 1; reach < kBlockThreads; reach *= 2) {
    const int before = me >= reach ? sums[me - reach] : 0;
    __syncthreads();
    sums[me] += before;
    __syncthreads();
  }
  int sum = sums[me] - own;
  for (int i = first; i < last; ++i) {
    const int here = counts[i];
    counts[i] = sum, sum += here;
  }
  if (me == kBlockThreads - 1) *total = sums[me];
}

// A root's number: the roots in earlier blocks, plus its rank in its own block.
struct NumberRoots {
  static constexpr const char* kName = "superpixels: number roots";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  __device__ void operator()() const {
    SDFTRACK_SHARED(int[kBlockThreads / 32], of_warp);
    const std::int64_t i = std::int64_t{blockIdx.x} * kBlockThreads + threadIdx.x;
    const int lane = static_cast<int>(threadIdx.x) % 32, warp = static_cast<int>(threadIdx.x) / 32;
    const bool root = i < s.pixels() && p.center[i] >= 0 && p.parent[i] == i;
    const unsigned roots = __ballot_sync(0xffffffffu, root);
    if (lane == 0) of_warp[warp] = __popc(roots);
    __syncthreads();
    int before = 0, all = 0;
    for (int k = 0; k < kBlockThreads / 32; ++k) {
      before += k < warp ? of_warp[k] : 0;
      all += of_warp[k];
    }
    if (root) p.rank[i] = before + __popc(roots & ((1u << lane) - 1));
    if (threadIdx.x == 0) p.block_count[blockIdx.x] = all;
    if (is_last_block(p.counters)) add_up(p.block_count, static_cast<int>(gridDim.x), &p.counters->segments);
  }
};

// Without connectivity: the centres that have pixels, in the order of the grid.
struct NumberCenters {
  static constexpr const char* kName = "superpixels: number centers";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  __device__ void operator()() const {
    each_of_mine(s.pixels(), [&](int i) {
      if (p.center[i] >= 0) p.number[p.center[i]] = 1;
    });
    if (is_last_block(p.counters)) add_up(p.number, s.cells(), &p.counters->segments);
  }
};

struct WriteLabels {
  static constexpr const char* kName = "superpixels: write labels";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  bool connected;
  __device__ void operator()() const {
    each_of_mine(s.pixels(), [&](int i) {
      const int center = p.center[i];
      p.labels[i] = center < 0 ? 0 : s.first_label + (connected ? number_of(p.parent[i]) : p.number[center]);
    });
  }
  __device__ int number_of(int root) const { return p.block_count[root / kBlockThreads] + p.rank[root]; }
};

}  // namespace sdftrack::superpixels
