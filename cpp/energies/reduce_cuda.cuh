// SPDX-License-Identifier: MIT
// Sums over pixels on the GPU. Every pixel's work is that of term.h; the order of the additions is fixed by
// the number of pixels alone, so a sum has the same bits on every run.
#pragma once

#include "energies/term.h"

namespace sdftrack::energies {

constexpr int kBlockThreads = 256, kBlockWarps = kBlockThreads / 32;
constexpr int kMaxBlocks = 264;  // two for each multiprocessor of a large GPU; more pixels per thread beyond

inline int blocks_for(int count) {
  const int blocks = (count + kBlockThreads - 1) / kBlockThreads;
  return blocks < kMaxBlocks ? blocks : kMaxBlocks;
}

// The numbers that a linearisation sums: cost, gradient, lower triangle of the Hessian.
template <int P>
constexpr int kSummed = 1 + P + P*(P + 1) / 2;

namespace {  // the tests compile the same source for the CPU

template <int N>
__device__ void add_over_block(const float (&value)[N], double* partial) {
  __shared__ double of_warp[kBlockWarps][N];
  const int lane = threadIdx.x % 32, warp = threadIdx.x / 32;
#pragma unroll
  for (int k = 0; k < N; ++k) {
    float sum = value[k];
#pragma unroll
    for (int half = 16; half > 0; half /= 2) sum += __shfl_down_sync(0xffffffffu, sum, half);
    if (lane == 0) of_warp[warp][k] = static_cast<double>(sum);
  }
  __syncthreads();
  for (int k = threadIdx.x; k < N; k += kBlockThreads) {
    double sum = 0;
    for (int w = 0; w < kBlockWarps; ++w) sum += of_warp[w][k];
    partial[static_cast<std::size_t>(blockIdx.x) * N + k] = sum;
  }
}

template <class Loop>
__global__ void __launch_bounds__(kBlockThreads) linearize_kernel(Loop term, double* partial) {
  constexpr int P = Loop::P;
  float sums[kSummed<P>] = {};
  for (int i = blockIdx.x * kBlockThreads + threadIdx.x; i < term.pixels.count;
       i += gridDim.x * kBlockThreads) {
    const Contribution<float, P> c = term.linearize(i);
    sums[0] += c.cost;
    int k = 1 + P;
#pragma unroll
    for (int a = 0; a < P; ++a) {
      sums[1 + a] += c.slope * c.J[a];
      const float weighted = c.curvature * c.J[a];
#pragma unroll
      for (int b = 0; b <= a; ++b) sums[k++] += weighted * c.J[b];
    }
  }
  add_over_block(sums, partial);
}

template <class Loop>
__global__ void __launch_bounds__(kBlockThreads) cost_kernel(Loop term, double* partial) {
  float sums[1] = {};
  for (int i = blockIdx.x * kBlockThreads + threadIdx.x; i < term.pixels.count;
       i += gridDim.x * kBlockThreads)
    sums[0] += term.cost(i);
  add_over_block(sums, partial);
}

template <class Loop>
__global__ void __launch_bounds__(kBlockThreads) settle_kernel(Loop term, int steps) {
  for (int i = blockIdx.x * kBlockThreads + threadIdx.x; i < term.pixels.count;
       i += gridDim.x * kBlockThreads)
    for (int step = 0; step < steps; ++step) term.settle(i, 1);
}

// One block: the blocks' sums in their order. A warp adds one number after another.
__global__ void __launch_bounds__(kBlockThreads)
    add_blocks_kernel(const double* partial, int blocks, int n, double* total) {
  const int lane = threadIdx.x % 32;
  for (int k = threadIdx.x / 32; k < n; k += kBlockWarps) {
    double sum = 0;
    for (int b = lane; b < blocks; b += 32) sum += partial[static_cast<std::size_t>(b) * n + k];
    for (int half = 16; half > 0; half /= 2) sum += __shfl_down_sync(0xffffffffu, sum, half);
    if (lane == 0) total[k] = sum;
  }
}

}  // namespace
}  // namespace sdftrack::energies
