// SPDX-License-Identifier: MIT
// HD marks a function compiled for the CPU and, when nvcc sees it, also for the GPU. It depends only on
// the compiler, never on __CUDA_ARCH__, so a function has one signature in both passes.
#pragma once

#ifdef __CUDACC__
#define HD __host__ __device__ inline
#elif defined(__GNUC__)
#define HD inline __attribute__((always_inline))  // per-pixel code: a call would cost more than its work
#else
#define HD inline
#endif
