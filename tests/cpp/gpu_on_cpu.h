// SPDX-License-Identifier: MIT
// Runs a CUDA kernel's own source on the CPU, one thread for each GPU thread of a block, block after block:
// slow, and proof of everything but the compiler and the launch. Include before the .cuh.
#pragma once

#include <array>
#include <barrier>
#include <memory>
#include <thread>
#include <vector>

#define __global__
#define __device__
#define __shared__ static  // one block at a time
#define __launch_bounds__(threads)

namespace gpu_on_cpu {

struct Index {
  int x = 0;
};
inline thread_local Index threadIdx, blockIdx, gridDim;

constexpr int kThreads = 256;
inline std::unique_ptr<std::barrier<>> block_barrier;
inline std::array<std::unique_ptr<std::barrier<>>, kThreads / 32> warp_barriers;
inline std::array<double, kThreads> exchanged;

inline void __syncthreads() { block_barrier->arrive_and_wait(); }

template <class T>
T __shfl_down_sync(unsigned, T value, int by) {
  const int me = threadIdx.x, lane = me % 32;
  std::barrier<>& warp = *warp_barriers[static_cast<std::size_t>(me / 32)];
  exchanged[static_cast<std::size_t>(me)] = static_cast<double>(value);
  warp.arrive_and_wait();
  const T got = lane + by < 32 ? static_cast<T>(exchanged[static_cast<std::size_t>(me + by)]) : value;
  warp.arrive_and_wait();
  return got;
}

// kernel() is called as every thread of every block.
template <class Kernel>
void launch(int blocks, const Kernel& kernel) {
  for (int b = 0; b < blocks; ++b) {
    block_barrier = std::make_unique<std::barrier<>>(kThreads);
    for (auto& barrier : warp_barriers) barrier = std::make_unique<std::barrier<>>(32);
    std::vector<std::thread> threads;
    for (int t = 0; t < kThreads; ++t)
      threads.emplace_back([&, t] {
        threadIdx.x = t, blockIdx.x = b, gridDim.x = blocks;
        kernel();
      });
    for (std::thread& thread : threads) thread.join();
  }
}

}  // namespace gpu_on_cpu

using gpu_on_cpu::__shfl_down_sync;
using gpu_on_cpu::__syncthreads;
using gpu_on_cpu::blockIdx;
using gpu_on_cpu::gridDim;
using gpu_on_cpu::threadIdx;
