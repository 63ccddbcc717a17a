// SPDX-License-Identifier: MIT
// The device's half: what nvcc knows by itself is included before everything else in each .cu file.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <functional>
#include <type_traits>
#include <utility>

#include "block.h"
#include "cuda_runtime_api.h"

#define __global__
#define __device__
#define __host__
#define __forceinline__ inline
#define __launch_bounds__(...)
// Memory of the block, in place of `__shared__ type name`: launch.cuh.
#define SDFTRACK_SHARED(type, name)                       \
  static char name##_key;                                 \
  auto& name = *static_cast<std::type_identity_t<type>*>( \
      cuda_on_cpu::shared_memory(&name##_key, sizeof(type), alignof(type)))

struct dim3 {
  unsigned x = 1, y = 1, z = 1;
  constexpr dim3(unsigned x_ = 1, unsigned y_ = 1, unsigned z_ = 1) : x(x_), y(y_), z(z_) {}
};
using cuda_on_cpu::blockDim;
using cuda_on_cpu::blockIdx;
using cuda_on_cpu::gridDim;
using cuda_on_cpu::threadIdx;

struct cudaLaunchAttribute {};
struct cudaLaunchConfig_t {
  dim3 gridDim, blockDim;
  std::size_t dynamicSmemBytes = 0;
  cudaStream_t stream = nullptr;
  cudaLaunchAttribute* attrs = nullptr;
  unsigned numAttrs = 0;
};

namespace cuda_on_cpu {
cudaError_t enqueue_grid(const cudaLaunchConfig_t& config, const char* name,
                         std::function<void()> as_each_thread);

// As launch.cuh has it of a kernel that is an object.
template <class First = void, class... Others>
constexpr const char* kernel_name() {
  if constexpr (requires { First::kName; })
    return First::kName;
  else
    return "without a name";
}
}  // namespace cuda_on_cpu

template <class... Expected, class... Given>
cudaError_t cudaLaunchKernelEx(const cudaLaunchConfig_t* config, void (*kernel)(Expected...),
                               Given&&... given) {
  return cuda_on_cpu::enqueue_grid(
      *config, cuda_on_cpu::kernel_name<Expected...>(),
      [kernel, ... values = Expected(std::forward<Given>(given))] { kernel(values...); });
}

inline void __syncthreads() { cuda_on_cpu::wait_for_block(); }
inline void __syncwarp(unsigned mask = 0xffffffffu) { cuda_on_cpu::wait_for_warp(mask); }
inline void __threadfence() {
#if defined(__SANITIZE_THREAD__)  // knows no fences: each sees what came before those that ran earlier
  static std::atomic<unsigned> fences{0};
  fences.fetch_add(1, std::memory_order_acq_rel);
#else
  std::atomic_thread_fence(std::memory_order_seq_cst);
#endif
}

namespace cuda_on_cpu {
// What lane `from` of the warp holds; its own value where there is no such lane.
template <class T>
T from_lane(unsigned mask, T value, int from) {
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) <= 8);
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof(T));
  bits = exchange(mask, bits, from);
  std::memcpy(&value, &bits, sizeof(T));
  return value;
}
}  // namespace cuda_on_cpu

template <class T>
T __shfl_down_sync(unsigned mask, T value, unsigned by) {
  return cuda_on_cpu::from_lane(mask, value, cuda_on_cpu::lane() + static_cast<int>(by));
}
template <class T>
T __shfl_xor_sync(unsigned mask, T value, int by) {
  return cuda_on_cpu::from_lane(mask, value, cuda_on_cpu::lane() ^ by);
}
template <class T>
T __shfl_sync(unsigned mask, T value, int from) {
  return cuda_on_cpu::from_lane(mask, value, from % 32);
}
inline unsigned __ballot_sync(unsigned mask, int predicate) {
  unsigned out = 0;
  for (int k = 0; k < 32; ++k)
    if (mask >> k & 1u && cuda_on_cpu::from_lane(mask, predicate != 0, k)) out |= 1u << k;
  return out;
}
inline int __popc(unsigned bits) { return __builtin_popcount(bits); }

// Relaxed, as the device's are. Others may run before and after.
template <class T, class Change>
T cuda_on_cpu_change(T* at, const Change& change) {
  cuda_on_cpu::let_others_run();
  std::atomic_ref<T> here(*at);
  T old = here.load(std::memory_order_relaxed);
  while (!here.compare_exchange_weak(old, change(old), std::memory_order_relaxed)) {
  }
  cuda_on_cpu::let_others_run();
  return old;
}
template <class T>
T atomicAdd(T* at, std::type_identity_t<T> value) {
  return cuda_on_cpu_change(at, [&](T old) { return static_cast<T>(old + value); });
}
template <class T>
T atomicMax(T* at, std::type_identity_t<T> value) {
  return cuda_on_cpu_change(at, [&](T old) { return std::max(old, value); });
}
template <class T>
T atomicExch(T* at, std::type_identity_t<T> value) {
  return cuda_on_cpu_change(at, [&](T) { return value; });
}
template <class T>
T atomicOr(T* at, std::type_identity_t<T> value) {
  return cuda_on_cpu_change(at, [&](T old) { return static_cast<T>(old | value); });
}
template <class T>
T atomicCAS(T* at, std::type_identity_t<T> expected, std::type_identity_t<T> value) {
  return cuda_on_cpu_change(at, [&](T old) { return old == expected ? value : old; });
}
