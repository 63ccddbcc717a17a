// SPDX-License-Identifier: MIT
// An array on a GPU that leaves this library, and work of others that this library waits for. No CUDA header
// is needed to include this; builds without CUDA have device_array_none.cpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

namespace sdftrack {

// A stream of somebody else, as CUDA and DLPack number it: 1 the legacy default one, 2 that of the host's
// thread, else an address.
using ForeignStream = std::uintptr_t;

class DeviceArray {
 public:
  DeviceArray(int device, std::size_t bytes);  // CudaError where there is no room
  ~DeviceArray();
  DeviceArray(DeviceArray&&) noexcept;
  DeviceArray& operator=(DeviceArray&&) noexcept;

  int device() const;
  void* data() const;
  std::size_t bytes() const;

  // The stream of device_stream.h that writes the array has got all that does so.
  void written_on(void* stream);
  // `stream` goes on when the array is written; the host does not wait.
  void ready_for(ForeignStream stream) const;
  void download(void* host) const;  // waits
  void upload(const void* host);    // waits

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// What others have on a GPU, and the stream on which they write it; 0: written before.
struct ForeignArray {
  const void* data = nullptr;
  ForeignStream stream = 0;
};

}  // namespace sdftrack
