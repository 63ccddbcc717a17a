// SPDX-License-Identifier: MIT
// What the kernels of superpixels work on. All sums are of whole numbers, so the order of the atomics has no
// say and the labels are the CPU's.
#pragma once

#include <cstdint>

#include "base/launch.cuh"
#include "base/strided.h"
#include "superpixels/slic_steps.h"

namespace sdftrack::superpixels {

using Word = unsigned long long;  // what atomics take

constexpr int kBlockThreads = 256;
constexpr int kRoundsAtOnce = 10, kJoinsAtOnce = 3;  // until the host looks whether it is done
constexpr int kSums = 7;                             // of a centre: count, three of colour, x, y, depth

// The way of all centres in a round lies in a ring, of which round r clears what round r + kAhead will use.
constexpr int kRing = 32, kAhead = 16;
static_assert(kRoundsAtOnce + 1 < kAhead);
HD int ring_slot(int round) { return round & (kRing - 1); }

// What the host reads with the labels.
struct SlicCounters {
  std::int64_t moved[kRing] = {};
  int joined[kJoinsAtOnce] = {};
  int segments = 0;
  unsigned blocks_done = 0;
  int unused = 0;  // no byte of what comes back is one that nobody has written
};
static_assert(sizeof(SlicCounters) == kRing * 8 + kJoinsAtOnce * 4 + 12);

// Everything on the device. Borrowed. Of centres there are two arrays and of sums three, that a round may
// read the last one's while it writes its own.
struct SlicPlanes {
  const std::uint8_t* bytes;
  const float* floats;
  const std::uint8_t* mask;
  const float* light;  // of a byte
  const int *x_begin, *y_begin, *x_middle, *y_middle, *x_place, *y_place;
  const int* z;  // may be null
  int *c01, *c2x, *center, *parent, *size, *labels;
  int* rank;   // of a region's root among those of its block; where c01 was
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

// work(i) for the numbers below n that are this thread's.
template <class Work>
__device__ void each_of_mine(std::int64_t n, const Work& work) {
  strided(std::int64_t{blockIdx.x} * kBlockThreads + threadIdx.x, std::int64_t{gridDim.x} * kBlockThreads, n,
          work);
}

}  // namespace sdftrack::superpixels
