// SPDX-License-Identifier: MIT
// A CUDA stream, and host memory that it can copy while the host goes on. Only builds with SDFTRACK_CUDA
// include this file.
#pragma once

#include "base/device_buffer.h"

namespace sdftrack {

class DeviceStream {
 public:
  DeviceStream() { SDFTRACK_CHECK_CUDA(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking)); }
  ~DeviceStream() { static_cast<void>(cudaStreamDestroy(stream_)); }  // a destructor cannot throw
  DeviceStream(const DeviceStream&) = delete;
  DeviceStream& operator=(const DeviceStream&) = delete;

  cudaStream_t get() const { return stream_; }
  void wait() const { SDFTRACK_CHECK_CUDA(cudaStreamSynchronize(stream_)); }

  // In the stream's order; the host's memory should be pinned, and left alone until wait().
  template <class T>
  void upload(const T* host, std::size_t count, T* device) const {
    SDFTRACK_CHECK_CUDA(cudaMemcpyAsync(device, host, count * sizeof(T), cudaMemcpyHostToDevice, stream_));
  }
  template <class T>
  void download(const T* device, std::size_t count, T* host) const {
    SDFTRACK_CHECK_CUDA(cudaMemcpyAsync(host, device, count * sizeof(T), cudaMemcpyDeviceToHost, stream_));
  }

 private:
  cudaStream_t stream_ = nullptr;
};

template <class T>
class PinnedBuffer {
 public:
  PinnedBuffer() = default;
  explicit PinnedBuffer(std::size_t size) {
    if (size > 0) SDFTRACK_CHECK_CUDA(cudaMallocHost(reinterpret_cast<void**>(&data_), size * sizeof(T)));
  }
  PinnedBuffer(PinnedBuffer&& other) noexcept : data_(std::exchange(other.data_, nullptr)) {}
  PinnedBuffer& operator=(PinnedBuffer&& other) noexcept {
    std::swap(data_, other.data_);
    return *this;
  }
  PinnedBuffer(const PinnedBuffer&) = delete;
  PinnedBuffer& operator=(const PinnedBuffer&) = delete;
  ~PinnedBuffer() { static_cast<void>(cudaFreeHost(data_)); }

  T* data() { return data_; }

 private:
  T* data_ = nullptr;
};

}  // namespace sdftrack
