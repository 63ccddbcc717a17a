// SPDX-License-Identifier: MIT
// The arrays of a volume on a GPU, and lists of its blocks.
#pragma once

#include "base/launch.cuh"
#include "levelset/crossing_terms.h"
#include "levelset/distance.h"
#include "levelset/evidence_blocks.h"

namespace sdftrack::levelset {

constexpr int kThreadsOfList = 1024, kThreadsPerBlocks = 128, kThreadsPerVoxels = 256,
              kThreadsPerPixels = 256;

enum Role : unsigned char { kUntouched, kChanged, kBeside };           // in the last frame
enum Marked : unsigned char { kNotMarked, kFollows, kFollowsIfNear };  // blocks whose distances may change
enum Shown { kPhiNotShown = 1, kColorNotShown = 2 };  // what is missing in the host's copy of a block

// By voxel, and by block. Not owned.
struct DeviceVoxels {
  float *log_ratio, *weight, *phi;
  VoxelColor* colors;
};
struct DeviceBlocks {
  unsigned char *empty, *spoken, *turned;                                 // evidence.h
  unsigned char *touched, *role, *source, *marked, *unsettled, *surface;  // distance.h
  int* shown;                                                             // Shown
  float* moved_m;
  SurfaceChange* change;
};
struct BlockList {
  int* blocks;
  int* count;
};

__device__ inline int global_thread(int threads) { return int(blockIdx.x) * threads + int(threadIdx.x); }

// Joins a value of each thread in halves, in a fixed order. `all` has room for `count`, a power of 2.
template <class T, class Join>
__device__ T over_block(T own, T* all, int count, const Join& join) {
  const int t = int(threadIdx.x);
  __syncthreads();
  all[t] = own;
  for (int half = count / 2; half > 0; half /= 2) {
    __syncthreads();
    if (t < half) all[t] = join(all[t], all[t + half]);
  }
  __syncthreads();
  return all[0];
}

// Lists the blocks that a rule picks, in their order: one list per block of threads, at most `blocks` long.
template <class Rule>
struct ListBlocks {
  static constexpr const char* kName = Rule::kName;
  static constexpr int kThreads = kThreadsOfList;
  Rule rule;  // rule(list, block)
  int blocks;
  BlockList lists;
  __device__ void operator()() const {
    SDFTRACK_SHARED(int[kThreadsOfList], before);
    const int list = int(blockIdx.x), t = int(threadIdx.x);
    const int each = (blocks + kThreadsOfList - 1) / kThreadsOfList, first = least(blocks, each * t),
              last = least(blocks, first + each);
    int own = 0;
    for (int b = first; b < last; ++b) own += rule(list, b) ? 1 : 0;
    before[t] = own;
    __syncthreads();
    for (int step = 1; step < kThreadsOfList; step *= 2) {
      const int more = t >= step ? before[t - step] : 0;
      __syncthreads();
      before[t] += more;
      __syncthreads();
    }
    int* const out = lists.blocks + std::size_t(list) * blocks;
    int at = before[t] - own;
    for (int b = first; b < last; ++b)
      if (rule(list, b)) out[at++] = b;
    if (t == kThreadsOfList - 1) lists.count[list] = before[t];
  }
};

}  // namespace sdftrack::levelset
