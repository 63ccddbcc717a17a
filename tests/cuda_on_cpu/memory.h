// SPDX-License-Identifier: MIT
// The memory of a device: addresses that the host cannot read, with marked bytes around each allocation.
#pragma once

#include <cstddef>
#include <map>

namespace cuda_on_cpu {

class DeviceMemory {
 public:
  explicit DeviceMemory(std::size_t bytes);
  ~DeviceMemory();
  DeviceMemory(const DeviceMemory&) = delete;
  DeviceMemory& operator=(const DeviceMemory&) = delete;

  void* allocate(std::size_t bytes);  // nullptr: full
  bool free(void* pointer);           // false: was not allocated
  // Whether [pointer, pointer + bytes) lies in one allocation.
  bool holds(const void* pointer, std::size_t bytes) const;
  bool owns(const void* pointer) const;  // an address of this device
  std::size_t bytes_in_use() const { return in_use_; }
  std::size_t bytes() const { return bytes_; }

  // Within open() ... close() the memory can be accessed. close() says whether the marked bytes are as they
  // were.
  void open();
  bool close();

 private:
  bool marks_hold() const;

  char* base_ = nullptr;
  std::size_t bytes_, in_use_ = 0, high_ = 0;     // high_: the end of what was ever used
  std::map<std::size_t, std::size_t> allocated_;  // offset: size
  std::map<std::size_t, std::size_t> freed_;      // the beginnings of what was freed and not given out again
  int open_ = 0;
};

}  // namespace cuda_on_cpu
