// SPDX-License-Identifier: MIT
// Sums over pixels on the GPU. The work per pixel is that of term.h. The order of the additions depends only
// on the number of pixels, so a sum has the same bits on every run.
#pragma once

#include <type_traits>

#include "base/launch.cuh"
#include "energies/term.h"

namespace sdftrack::energies {

constexpr int kBlockThreads = 256, kBlockWarps = kBlockThreads / 32;
constexpr int kMaxBlocks = 264;  // two per multiprocessor of a large GPU; then more pixels per thread

inline int blocks_for(int count) { return int(blocks_of(count, kBlockThreads, kMaxBlocks)); }

// The numbers that a linearisation sums: cost, gradient, lower triangle of the Hessian.
template <int P>
constexpr int kSummed = 1 + P + P*(P + 1) / 2;
constexpr int kMostInRegisters = 128;  // sums that a thread keeps in its 255 registers

// Adds the warps' sums of N numbers in the order of the warps; `partial` are this block's N sums.
template <class T, int N>
__device__ void add_warps(const T (&of_warp)[kBlockWarps][N], double* partial) {
  __syncthreads();
  for (int k = threadIdx.x; k < N; k += kBlockThreads) {
    double sum = 0;
    for (int w = 0; w < kBlockWarps; ++w) sum += double(of_warp[w][k]);
    partial[k] = sum;
  }
}
template <int N>
__device__ double* of_this_block(double* partial) {
  return partial + std::size_t(blockIdx.x) * N;
}

template <class T, int N>
__device__ void add_over_block(const T (&value)[N], double* partial) {
  SDFTRACK_SHARED(T[kBlockWarps][N], of_warp);
  const int lane = threadIdx.x % 32, warp = threadIdx.x / 32;
#pragma unroll
  for (int k = 0; k < N; ++k) {
    T sum = value[k];
#pragma unroll
    for (int half = 16; half > 0; half /= 2) sum += __shfl_down_sync(0xffffffffu, sum, half);
    if (lane == 0) of_warp[warp][k] = sum;
  }
  add_warps(of_warp, partial);
}

// Adds a contribution to `sums`, in the order of kSummed.
template <class T, int P>
__device__ void add_contribution(const Contribution<T, P>& c, T* sums) {
  sums[0] += c.cost;
  int k = 1 + P;
#pragma unroll
  for (int a = 0; a < P; ++a) {
    sums[1 + a] += c.slope * c.J[a];
    const T weighted = c.curvature * c.J[a];
#pragma unroll
    for (int b = 0; b <= a; ++b) sums[k++] += weighted * c.J[b];
  }
}

template <class Loop>
struct Linearize {
  static constexpr const char* kName = "linearize";
  static constexpr int kThreads = kBlockThreads;
  Loop term;
  double* partial;

  __device__ void operator()() const {
    constexpr int P = Loop::P;
    float sums[kSummed<P>] = {};
    for (int i = blockIdx.x * kBlockThreads + threadIdx.x; i < term.pixels.count;
         i += gridDim.x * kBlockThreads)
      add_contribution(term.linearize(i), sums);
    add_over_block(sums, of_this_block<kSummed<P>>(partial));
  }
};

// As Linearize, for more unknowns than a thread has registers for: the lanes of a warp share the sums. They
// read the result of each lane's pixel from the block's memory.
template <class Loop>
struct SumsOfLanes {
  static constexpr int P = Loop::P, N = kSummed<P>, kShare = (N + 31) / 32;
  static constexpr int kSlope = P, kCurvature = P + 1, kCost = P + 2, kOne = P + 3, kHeld = P + 4;
  using Held = float[kBlockWarps][32][kHeld];
  using OfWarp = float[kBlockWarps][N];

  // Sums the block's share of the pixels, from `first` on in steps of `stride`; `partial` are its N sums.
  // held and of_warp may be the same memory.
  __device__ static void add(const Loop& term, int first, int stride, Held& held, OfWarp& of_warp,
                             double* partial) {
    const int lane = threadIdx.x % 32, warp = threadIdx.x / 32;
    float sums[kShare] = {};
    for (int at = first + 32 * warp; at < term.pixels.count; at += stride) {
      hold(term, at + lane, held[warp][lane]);
      __syncwarp();
#pragma unroll
      for (int k = 0; k < kShare; ++k) {
        const Product of = product_of(32 * k + lane);
        for (int p = 0; p < 32; ++p) {
          const float* const v = held[warp][p];
          sums[k] += v[of.a] * v[of.b] * v[of.c];
        }
      }
      __syncwarp();
    }
    __syncthreads();
#pragma unroll
    for (int k = 0; k < kShare; ++k)
      if (32 * k + lane < N) of_warp[warp][32 * k + lane] = sums[k];
    add_warps(of_warp, partial);
  }

 private:
  struct Product {  // indices of three of the held numbers
    int a, b, c;
  };
  __device__ static void hold(const Loop& term, int i, float* out) {
    for (int k = 0; k < kHeld; ++k) out[k] = 0;
    if (i >= term.pixels.count) return;
    const Contribution<float, P> c = term.linearize(i);
    for (int a = 0; a < P; ++a) out[a] = c.J[a];
    out[kSlope] = c.slope, out[kCurvature] = c.curvature, out[kCost] = c.cost, out[kOne] = 1;
  }
  // The product of the n-th sum; arbitrary beyond the last sum.
  __device__ static Product product_of(int n) {
    if (n == 0 || n >= N) return {kCost, kOne, kOne};
    if (n <= P) return {kSlope, n - 1, kOne};
    int a = 0, rest = n - 1 - P;
    while (rest > a) rest -= ++a;
    return {kCurvature, a, rest};
  }
};

template <class Loop>
struct LinearizeShared {
  static constexpr const char* kName = "linearize several objects";
  static constexpr int kThreads = kBlockThreads;
  Loop term;
  double* partial;

  __device__ void operator()() const {
    using Sums = SumsOfLanes<Loop>;
    SDFTRACK_SHARED(typename Sums::Held, held);
    SDFTRACK_SHARED(typename Sums::OfWarp, of_warp);
    Sums::add(term, blockIdx.x * kBlockThreads, gridDim.x * kBlockThreads, held, of_warp,
              of_this_block<Sums::N>(partial));
  }
};

template <class Loop>
using LinearizeOf =
    std::conditional_t<(kSummed<Loop::P> > kMostInRegisters), LinearizeShared<Loop>, Linearize<Loop>>;

template <class Loop>
struct Cost {
  static constexpr const char* kName = "cost";
  static constexpr int kThreads = kBlockThreads;
  Loop term;
  double* partial;

  __device__ void operator()() const {
    float sums[1] = {};
    for (int i = blockIdx.x * kBlockThreads + threadIdx.x; i < term.pixels.count;
         i += gridDim.x * kBlockThreads)
      sums[0] += term.cost(i);
    add_over_block(sums, of_this_block<1>(partial));
  }
};

template <class Loop>
struct Settle {
  static constexpr const char* kName = "settle";
  static constexpr int kThreads = kBlockThreads;
  Loop term;
  int steps;

  __device__ void operator()() const {
    for (int i = blockIdx.x * kBlockThreads + threadIdx.x; i < term.pixels.count;
         i += gridDim.x * kBlockThreads)
      for (int step = 0; step < steps; ++step) term.settle(i, 1);
  }
};

// Adds the sums of `blocks` blocks in a fixed order; each warp adds one number after another. `volatile`
// avoids a multiprocessor's cache, which the sums of other multiprocessors do not reach.
__device__ inline void add_blocks(const volatile double* partial, int blocks, int n, double* total) {
  const int lane = threadIdx.x % 32;
  for (int k = threadIdx.x / 32; k < n; k += kBlockWarps) {
    double sum = 0;
    for (int b = lane; b < blocks; b += 32) sum += partial[std::size_t(b) * n + k];
    for (int half = 16; half > 0; half /= 2) sum += __shfl_down_sync(0xffffffffu, sum, half);
    if (lane == 0) total[k] = sum;
  }
}

struct AddBlocks {
  static constexpr const char* kName = "add blocks";
  static constexpr int kThreads = kBlockThreads;
  const double* partial;
  int blocks, n;
  double* total;

  __device__ void operator()() const { add_blocks(partial, blocks, n, total); }
};

}  // namespace sdftrack::energies
