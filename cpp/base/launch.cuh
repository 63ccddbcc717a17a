// SPDX-License-Identifier: MIT
// Starts kernels. A kernel is an object that is called as every thread, with its name and the threads of a
// block:
//   struct Clear { static constexpr const char* kName = "clear"; static constexpr int kThreads = 256; ... };
#pragma once

#include <cuda_runtime.h>

#include <type_traits>

#include "base/device_stream.h"

// Memory that the threads of a block share.
#ifndef SDFTRACK_SHARED
#define SDFTRACK_SHARED(type, name) __shared__ std::type_identity_t<type> name
#endif

namespace sdftrack {

template <class Kernel>
__global__ void __launch_bounds__(Kernel::kThreads) run_kernel(Kernel kernel) {
  kernel();
}

// Runs after the work already in the stream. `threads` may have two dimensions, kThreads in all.
template <class Kernel>
void launch(const DeviceStream& stream, dim3 blocks, const Kernel& kernel, dim3 threads = Kernel::kThreads) {
  if (const unsigned all = threads.x * threads.y * threads.z; all > Kernel::kThreads)
    throw CudaError(std::string("CUDA: ") + Kernel::kName + ": more threads than it is compiled for");
  cudaLaunchConfig_t config{};
  config.gridDim = blocks, config.blockDim = threads, config.stream = stream.get();
  check_cuda(cudaLaunchKernelEx(&config, run_kernel<Kernel>, kernel), Kernel::kName);
}

// Number of blocks with one thread per number of n, at least one and at most `most`.
inline unsigned blocks_of(std::int64_t n, int threads, std::int64_t most = 0x7fffffff) {
  const std::int64_t blocks = (n + threads - 1) / threads;
  return static_cast<unsigned>(blocks < 1 ? 1 : (blocks > most ? most : blocks));
}

}  // namespace sdftrack
