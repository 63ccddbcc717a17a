// SPDX-License-Identifier: MIT
// The data of the superpixel kernels. All sums are of whole numbers, so the order of the atomics does not
// matter and the labels equal the CPU's.
#pragma once

#include <cstdint>

#include "base/launch.cuh"
#include "base/strided.h"
#include "superpixels/slic_steps.h"

namespace sdftrack::superpixels {

using Word = unsigned long long;  // the type for atomics

constexpr int kBlockThreads = 256;
constexpr int kRoundsAtOnce = 10, kJoinsAtOnce = 3;  // until the host checks for the end
constexpr int kSums = 7;                             // of a centre: count, three of colour, x, y, depth

// The centres' motion per round is in a ring; round r clears the entry that round r + kAhead will use.
constexpr int kRing = 32, kAhead = 16;
static_assert(kRoundsAtOnce + 1 < kAhead);
HD int ring_slot(int round) { return round & (kRing - 1); }

// The counters that the host reads with the labels.
struct SlicCounters {
  std::int64_t moved[kRing] = {};
  int joined[kJoinsAtOnce] = {};
  int segments = 0;
  unsigned blocks_done = 0;
  int unused = 0;  // so that no byte that is copied back is uninitialised
};
static_assert(sizeof(SlicCounters) == kRing * 8 + kJoinsAtOnce * 4 + 12);

// Everything on the device, borrowed. There are two arrays of centres and three of sums, so that a round can
// read the last round's while it writes its own.
struct SlicPlanes {
  const std::uint8_t* bytes;
  const float* floats;
  const std::uint8_t* mask;
  const float* light;  // for each byte value
  const int *x_begin, *y_begin, *x_middle, *y_middle, *x_place, *y_place;
  const int* z;  // may be null
  int *c01, *c2x, *center, *parent, *size, *labels;
  int* rank;   // of a region's root among those of its block; in the memory of c01
  Word* best;  // of a region: its choice
  Center* centers;
  Word* sums;
  int* block_count;  // roots in each block of pixels
  int* number;       // of centres, without connectivity
  SlicCounters* counters;
};
struct SlicShape {
  int width, height, channels, nx, ny;
  double unit;
  float scale;
  int first_label, min_size;
  ColorSpace space;
  SlicDistance distance;

  HD int pixels() const { return width * height; }
  HD int cells() const { return nx * ny; }
  HD std::int64_t center_at(int round, int c) const {
    return static_cast<std::int64_t>(round & 1) * cells() + c;
  }
  HD std::int64_t sums_at(int round, int c) const {
    return (static_cast<std::int64_t>(round % 3) * cells() + c) * kSums;
  }
};

// work(i) for this thread's share of the numbers below n.
template <class Work>
__device__ void each_of_mine(std::int64_t n, const Work& work) {
  strided(std::int64_t{blockIdx.x} * kBlockThreads + threadIdx.x, std::int64_t{gridDim.x} * kBlockThreads, n,
          work);
}

}  // namespace sdftrack::superpixels
