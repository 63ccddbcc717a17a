// SPDX-License-Identifier: MIT
// The data of a CudaWork, for the files that queue work on its stream.
#pragma once

#include <algorithm>

#include "base/device_stream.h"
#include "base/device_volumes.h"
#include "energies/cuda_work.h"
#include "energies/reduce_cuda.cuh"

namespace sdftrack::energies {

constexpr int kMaxSummed = kSummed<Four::P>;
constexpr int kColumns = 7;  // u, v, depth, 1 / noise, foreground, hit, gain
constexpr std::size_t kMostVolumes = 128;

// The pixels are one block of memory, column after column, so that one copy transfers them.
struct CudaWork::Impl {
  explicit Impl(int device_) : device(device_) {}

  int device;
  DeviceStream stream;
  int count = 0;  // pixels
  enum Pinned { kStaging, kPlaces, kProblems };
  bool busy[3] = {};  // per pinned buffer: a copy from or to it may still be running
  DeviceBuffer<float> pixels;
  PinnedBuffer<float> staging;
  DeviceBuffer<double> partial{std::size_t(kMaxBlocks) * kMaxSummed}, total{kMaxSummed};
  PinnedBuffer<double> sums{kMaxSummed};
  DeviceVolumes volumes{kMostVolumes}, colors{kMostVolumes};

  // Memory of searches, and of the choice of their pixels.
  DeviceBuffer<std::byte> problems;
  PinnedBuffer<std::byte> problems_here;
  DeviceBuffer<double> search_partial;
  DeviceBuffer<float> image;  // depth, and the rays where the lens distorts
  DeviceBuffer<unsigned char> mask;
  DeviceBuffer<std::byte> places;
  PinnedBuffer<std::byte> places_here;
  DeviceBuffer<int> chosen;

  float* column(int k) { return pixels.data() + std::ptrdiff_t(k) * count; }
  PixelsView<float> view() {
    return {count, column(0), column(1), column(2), column(3), column(5), column(6), column(4)};
  }

  void wait() {
    stream.wait();
    std::fill(busy, busy + 3, false);
  }
  // Call this before the host writes to `memory` for a copy.
  void take_turn(Pinned memory) {
    if (busy[memory]) wait();
    busy[memory] = true;
  }
  // Adds the blocks' sums, waits, and returns the first n totals in host memory.
  const double* finish(int blocks, int n) {
    launch(stream, 1, AddBlocks{partial.data(), blocks, n, total.data()});
    stream.download(total.data(), std::size_t(n), sums.data());
    wait();
    return sums.data();
  }
  // Queues the copy of the hits and classes, which is complete after wait().
  void queue_hits() {
    busy[kStaging] = true;
    stream.download(column(5), 2 * std::size_t(count), staging.data());
  }
  void take_hits(PixelSet* set) const {
    const auto n = std::size_t(count);
    std::copy_n(staging.data(), n, set->hit_m.data());
    std::copy_n(staging.data() + n, n, set->gain.data());
  }
};

}  // namespace sdftrack::energies
