// SPDX-License-Identifier: MIT
// Owned GPU memory. Only builds with SDFTRACK_CUDA include this file. A failing CUDA call becomes an
// exception that carries the call; nothing here exits or resets the device.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
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
  if (code != cudaSuccess)
    throw CudaError(std::string(call) + ": " + cudaGetErrorName(code) + ", " + cudaGetErrorString(code));
}
#define SDFTRACK_CHECK_CUDA(call) ::sdftrack::check_cuda((call), #call)

// n values of T in GPU memory, freed with the buffer. Copies are blocking: simple first, streams where a
// measurement asks for them.
template <class T>
class DeviceBuffer {
 public:
  DeviceBuffer() = default;
  explicit DeviceBuffer(std::size_t size) : size_(size) {
    if (size_ > 0) SDFTRACK_CHECK_CUDA(cudaMalloc(reinterpret_cast<void**>(&data_), size_ * sizeof(T)));
  }
  explicit DeviceBuffer(const std::vector<T>& values) : DeviceBuffer(values.size()) {
    upload(values.data(), values.size());
  }
  DeviceBuffer(DeviceBuffer&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }
  DeviceBuffer(const DeviceBuffer&) = delete;
  DeviceBuffer& operator=(const DeviceBuffer&) = delete;
  ~DeviceBuffer() { static_cast<void>(cudaFree(data_)); }  // a destructor cannot throw

  T* data() { return data_; }
  const T* data() const { return data_; }
  std::size_t size() const { return size_; }

  void upload(const T* values, std::size_t count) {
    check_fits(count);
    if (count > 0) SDFTRACK_CHECK_CUDA(cudaMemcpy(data_, values, count * sizeof(T), cudaMemcpyHostToDevice));
  }
  void download(T* values, std::size_t count) const {
    check_fits(count);
    if (count > 0) SDFTRACK_CHECK_CUDA(cudaMemcpy(values, data_, count * sizeof(T), cudaMemcpyDeviceToHost));
  }
  std::vector<T> to_host() const {
    std::vector<T> values(size_);
    download(values.data(), size_);
    return values;
  }

 private:
  void check_fits(std::size_t count) const {
    if (count > size_)
      throw std::invalid_argument("DeviceBuffer: expected at most " + std::to_string(size_) +
                                  " values, got " + std::to_string(count));
  }

  T* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace sdftrack
