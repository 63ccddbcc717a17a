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
      const bool said =
          i % s.width > 0 && p.center[i - 1] == p.center[i] && p.center[i - s.width - 1] == p.center[i];
      if (!said) unite(p.parent, i, i - s.width);
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
      unite(p.parent, i, static_cast<int>(0xffffffffu - static_cast<unsigned>(best & 0xffffffffu)));
      p.counters->joined[round] = 1;
    });
  }
};

}  // namespace sdftrack::superpixels
