// SPDX-License-Identifier: MIT
// Events in a stream's queue. Only builds with SDFTRACK_CUDA include this file.
#pragma once

#include "base/device_stream.h"

namespace sdftrack {

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
