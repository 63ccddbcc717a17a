// SPDX-License-Identifier: MIT
// Arrays on a GPU for and from other libraries. Without CUDA cuda_none.cpp replaces it; no CUDA header is
// needed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

namespace sdftrack {

// A stream of another library, numbered as in CUDA and DLPack: 1 is the legacy default stream, 2 that of the
// host's thread; otherwise an address.
using ForeignStream = std::uintptr_t;

class DeviceArray {
 public:
  DeviceArray(int device, std::size_t bytes);  // throws CudaError if there is no room
  ~DeviceArray();
  DeviceArray(DeviceArray&&) noexcept;
  DeviceArray& operator=(DeviceArray&&) noexcept;

  int device() const;
  void* data() const;
  std::size_t bytes() const;

  // Call it when all writes to the array are queued on `stream` (device_stream.h).
  void written_on(void* stream);
  // `stream` continues once the array is written; the host does not wait.
  void ready_for(ForeignStream stream) const;
  void download(void* host) const;  // waits
  void upload(const void* host);    // waits

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// An array of another library on a GPU, and the stream that writes it; 0: already written.
struct ForeignArray {
  const void* data = nullptr;
  ForeignStream stream = 0;
};

}  // namespace sdftrack
