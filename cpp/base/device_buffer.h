// SPDX-License-Identifier: MIT
// Owned memory of a GPU, and of the host where a GPU can read it. Only builds with SDFTRACK_CUDA include this
// file. A failed CUDA call throws an exception that names the call; nothing here exits or resets the device.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace sdftrack {

class CudaError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

inline void check_cuda(cudaError_t code, const char* call) {
  if (code == cudaSuccess) return;
  static_cast<void>(cudaGetLastError());  // clears the error for the next call
  throw CudaError(std::string("CUDA: ") + call + ": " + cudaGetErrorName(code) + ", " +
                  cudaGetErrorString(code));
}
#define SDFTRACK_CHECK_CUDA(call) ::sdftrack::check_cuda((call), #call)

// Memory that is unused at present, and is freed before a device is reported as full.
class IdleMemory {
 public:
  static void on_shortage(std::function<void()> free) {
    const std::lock_guard lock(mutex());
    all().push_back(std::move(free));
  }
  static void free() {
    const std::lock_guard lock(mutex());
    for (const auto& one : all()) one();
  }

 private:
  // Never destroyed: at the end of the process CUDA may end before it.
  static std::mutex& mutex() {
    static auto* const one = new std::mutex;
    return *one;
  }
  static std::vector<std::function<void()>>& all() {
    static auto* const list = new std::vector<std::function<void()>>;
    return *list;
  }
};

// n values of T, allocated and freed by Memory.
template <class T, class Memory>
class CudaBuffer {
 public:
  CudaBuffer() = default;
  explicit CudaBuffer(std::size_t size) {
    if (size > SIZE_MAX / sizeof(T)) throw CudaError("CUDA: more memory than can be addressed");
    if (size > 0) Memory::take(reinterpret_cast<void**>(&data_), size * sizeof(T));
    size_ = size;
  }
  CudaBuffer(CudaBuffer&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  CudaBuffer& operator=(CudaBuffer&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }
  CudaBuffer(const CudaBuffer&) = delete;
  CudaBuffer& operator=(const CudaBuffer&) = delete;
  ~CudaBuffer() { Memory::give_back(data_); }

  T* data() { return data_; }
  const T* data() const { return data_; }
  std::size_t size() const { return size_; }

  // Room for n values. If the buffer has to grow, the old memory is freed first, so that only one copy
  // exists. After an exception the buffer is empty.
  T* room(std::size_t n) {
    if (n > size_) {
      Memory::give_back(std::exchange(data_, nullptr));
      size_ = 0;
      *this = CudaBuffer(n);
    }
    return data_;
  }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

struct GlobalMemory {  // of the calling thread's current device
  static void take(void** data, std::size_t bytes) {
    cudaError_t code = cudaMalloc(data, bytes);
    if (code == cudaErrorMemoryAllocation) {
      static_cast<void>(cudaGetLastError());
      IdleMemory::free();
      code = cudaMalloc(data, bytes);
    }
    check_cuda(code, "cudaMalloc");
  }
  static void give_back(void* data) noexcept {
    // Not for nullptr, which would start CUDA. An error here is from earlier work and was reported.
    if (data && cudaFree(data) != cudaSuccess) static_cast<void>(cudaGetLastError());
  }
};
struct PinnedMemory {  // of the host
  static void take(void** data, std::size_t bytes) { SDFTRACK_CHECK_CUDA(cudaMallocHost(data, bytes)); }
  static void give_back(void* data) noexcept {
    if (data && cudaFreeHost(data) != cudaSuccess) static_cast<void>(cudaGetLastError());
  }
};

template <class T>
using DeviceBuffer = CudaBuffer<T, GlobalMemory>;
template <class T>
using PinnedBuffer = CudaBuffer<T, PinnedMemory>;

}  // namespace sdftrack
