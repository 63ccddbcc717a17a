// SPDX-License-Identifier: MIT
// Connectivity on the device: the steps of connect.h, a thread for each pixel. A pixel's parent is never a
// later pixel, so that a region's root is its first pixel. Between rounds all of `size` and `best` are 0.
#pragma once

#include "base/union_find.cuh"
#include "superpixels/slic_rounds.cuh"

namespace sdftrack::superpixels {

struct StartRegions {
  static constexpr const char* kName = "superpixels: start regions";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  __device__ void operator()() const {
    each_of_mine(s.pixels(), [&](int i) {
      const bool as_left = i % s.width > 0 && p.center[i - 1] == p.center[i];
      p.parent[i] = as_left ? i - 1 : i;
      p.size[i] = 0, p.best[i] = 0;
    });
  }
};

struct JoinPixels {
  static constexpr const char* kName = "superpixels: join pixels";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  __device__ void operator()() const {
    each_of_mine(s.pixels(), [&](int i) {
      if (p.center[i] < 0 || i < s.width || p.center[i - s.width] != p.center[i]) return;
      // Where the left pixel and the one above it have this centre too, they already join the rows.
      const bool joined_before =
          i % s.width > 0 && p.center[i - 1] == p.center[i] && p.center[i - s.width - 1] == p.center[i];
      if (!joined_before) unite(p.parent, i, i - s.width);
    });
  }
};

// After a round without any join the later rounds have nothing to do.
__device__ inline bool joins_ended(const SlicPlanes& p, int round) {
  return round > 0 && p.counters->joined[round - 1] == 0;
}

// Makes every parent a root and counts each root's pixels. Others may shorten the same paths meanwhile.
struct CountSizes {
  static constexpr const char* kName = "superpixels: count sizes";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  int round;
  __device__ void operator()() const {
    if (joins_ended(p, round)) return;
    each_of_mine(s.pixels(), [&](int i) {
      const int root = root_of(p.parent, i);
      *const_cast<volatile int*>(p.parent + i) = root;
      atomicAdd(&p.size[root], 1);
    });
  }
};

// The largest neighbour of each small region, of equals the first.
struct ChooseNeighbors {
  static constexpr const char* kName = "superpixels: choose neighbors";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  int round;
  __device__ void operator()() const {
    if (joins_ended(p, round)) return;
    each_of_mine(s.pixels(), [&](int i) {
      const int own = p.parent[i];
      if (p.center[i] < 0 || p.size[own] >= s.min_size) return;
      const int x = i % s.width;
      if (x > 0) tell(own, i - 1);
      if (x + 1 < s.width) tell(own, i + 1);
      if (i >= s.width) tell(own, i - s.width);
      if (i < s.pixels() - s.width) tell(own, i + s.width);
    });
  }
  __device__ void tell(int own, int other) const {
    const int root = p.parent[other];
    if (p.center[other] < 0 || root == own) return;
    const Word key = static_cast<Word>(p.size[root]) << 32 | (0xffffffffu - static_cast<unsigned>(root));
    atomicMax(&p.best[own], key);
  }
};

struct JoinChoices {
  static constexpr const char* kName = "superpixels: join choices";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  int round;
  __device__ void operator()() const {
    if (joins_ended(p, round)) return;
    each_of_mine(s.pixels(), [&](int i) {
      if (p.size[i] != 0) p.size[i] = 0;
      const Word best = p.best[i];
      if (best == 0) return;
      p.best[i] = 0;
      unite(p.parent, i, int(0xffffffffu - static_cast<unsigned>(best & 0xffffffffu)));
      p.counters->joined[round] = 1;
    });
  }
};

// Numbers in the order of the image on the device. The last block to finish adds up the counts of all.

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
  const int me = int(threadIdx.x), each = (n + kBlockThreads - 1) / kBlockThreads;
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
    const int lane = int(threadIdx.x) % 32, warp = int(threadIdx.x) / 32;
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
    if (is_last_block(p.counters)) add_up(p.block_count, int(gridDim.x), &p.counters->segments);
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
