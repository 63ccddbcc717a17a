// SPDX-License-Identifier: MIT
// A queue of work on one GPU: copies and kernels run in order while the host continues. All copies go through
// a stream: a copy outside it would not wait for its kernels, nor the kernels for the copy. Only builds with
// SDFTRACK_CUDA include this file.
#pragma once

#include <cstdint>

#include "base/device_buffer.h"

namespace sdftrack {

// Makes a device the calling thread's current one for the lifetime of this object.
class DeviceScope {
 public:
  explicit DeviceScope(int device) {
    SDFTRACK_CHECK_CUDA(cudaGetDevice(&before_));
    if (device != before_) SDFTRACK_CHECK_CUDA(cudaSetDevice(device));
    changed_ = device != before_;
  }
  ~DeviceScope() {
    if (changed_ && cudaSetDevice(before_) != cudaSuccess)
      static_cast<void>(cudaGetLastError());  // a destructor cannot throw
  }
  DeviceScope(const DeviceScope&) = delete;
  DeviceScope& operator=(const DeviceScope&) = delete;

 private:
  int before_ = 0;
  bool changed_ = false;
};

class DeviceStream {
 public:
  // Belongs to the calling thread's current device.
  DeviceStream() { SDFTRACK_CHECK_CUDA(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking)); }
  ~DeviceStream() {
    if (cudaStreamDestroy(stream_) != cudaSuccess) static_cast<void>(cudaGetLastError());
  }
  DeviceStream(const DeviceStream&) = delete;
  DeviceStream& operator=(const DeviceStream&) = delete;

  cudaStream_t get() const { return stream_; }
  void wait() const { SDFTRACK_CHECK_CUDA(cudaStreamSynchronize(stream_)); }

  // The host's memory must not change until wait(): pinned memory is read later, and so may be pageable
  // memory if the device reads it directly (cudaDevAttrPageableMemoryAccessUsesHostPageTables).
  template <class T>
  void upload(const T* host, std::size_t count, T* device) const {
    if (count > 0)
      SDFTRACK_CHECK_CUDA(cudaMemcpyAsync(device, host, count * sizeof(T), cudaMemcpyHostToDevice, stream_));
  }
  // Complete after wait(). The host's memory must live until then: see StreamWaiter.
  template <class T>
  void download(const T* device, std::size_t count, T* host) const {
    if (count > 0)
      SDFTRACK_CHECK_CUDA(cudaMemcpyAsync(host, device, count * sizeof(T), cudaMemcpyDeviceToHost, stream_));
  }
  // Continues after the work that is now queued on another stream; the host does not wait. 0: no stream.
  void follow(std::uintptr_t stream) const {
    if (stream == 0) return;
    const auto other = reinterpret_cast<cudaStream_t>(stream);
    cudaEvent_t event = nullptr;
    SDFTRACK_CHECK_CUDA(cudaEventCreateWithFlags(&event, cudaEventDisableTiming));
    const cudaError_t recorded = cudaEventRecord(event, other);
    const cudaError_t waits = recorded == cudaSuccess ? cudaStreamWaitEvent(stream_, event, 0) : recorded;
    static_cast<void>(cudaEventDestroy(event));  // CUDA frees it when it is no longer needed
    check_cuda(waits, "the wait for another stream");
  }
  template <class T>
  void fill_zero(T* device, std::size_t count) const {
    if (count > 0) SDFTRACK_CHECK_CUDA(cudaMemsetAsync(device, 0, count * sizeof(T), stream_));
  }

 private:
  cudaStream_t stream_ = nullptr;
};

// Waits at the end of a scope, also after an exception, so that the stream's writes to host memory end before
// that memory is freed. Declare it after the memory.
class StreamWaiter {
 public:
  explicit StreamWaiter(const DeviceStream& stream) : stream_(stream) {}
  ~StreamWaiter() {
    if (cudaStreamSynchronize(stream_.get()) != cudaSuccess) static_cast<void>(cudaGetLastError());
  }
  StreamWaiter(const StreamWaiter&) = delete;
  StreamWaiter& operator=(const StreamWaiter&) = delete;

 private:
  const DeviceStream& stream_;
};

// A place in a stream's queue that the host can wait for while the stream continues.
class DeviceEvent {
 public:
  // Belongs to the calling thread's current device.
  DeviceEvent() { SDFTRACK_CHECK_CUDA(cudaEventCreateWithFlags(&event_, cudaEventDisableTiming)); }
  ~DeviceEvent() {
    if (cudaEventDestroy(event_) != cudaSuccess) static_cast<void>(cudaGetLastError());
  }
  DeviceEvent(const DeviceEvent&) = delete;
  DeviceEvent& operator=(const DeviceEvent&) = delete;

  void record(const DeviceStream& stream) const {
    SDFTRACK_CHECK_CUDA(cudaEventRecord(event_, stream.get()));
  }
  void wait() const { SDFTRACK_CHECK_CUDA(cudaEventSynchronize(event_)); }

 private:
  cudaEvent_t event_ = nullptr;
};

}  // namespace sdftrack
