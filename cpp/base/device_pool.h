// SPDX-License-Identifier: MIT
// Working memory on a GPU that calls borrow one after another. At most one is kept per device, until memory
// runs short there. Only builds with SDFTRACK_CUDA include this file.
#pragma once

#include <map>
#include <memory>
#include <mutex>

#include "base/device_stream.h"

namespace sdftrack {

// Work has a member `stream` and is created on the current device.
template <class Work>
class DevicePool {
 public:
  // The work of one call. Its destructor waits for the stream, also after an exception.
  class Borrowed {
   public:
    Borrowed(DevicePool* pool, int device)
        : scope_(device), pool_(pool), device_(device), work_(pool->take(device)) {}
    ~Borrowed() {
      if (cudaStreamSynchronize(work_->stream.get()) != cudaSuccess) static_cast<void>(cudaGetLastError());
      pool_->give_back(device_, std::move(work_));
    }
    Borrowed(const Borrowed&) = delete;
    Borrowed& operator=(const Borrowed&) = delete;
    Work* operator->() const { return work_.get(); }
    Work& operator*() const { return *work_; }

   private:
    DeviceScope scope_;
    DevicePool* pool_;
    int device_;
    std::unique_ptr<Work> work_;
  };

  Borrowed borrow(int device) { return Borrowed(this, device); }

  void free_idle() {
    std::map<int, std::unique_ptr<Work>> idle;
    {
      const std::lock_guard lock(mutex_);
      idle.swap(idle_);
    }
  }

 private:
  std::unique_ptr<Work> take(int device) {
    {
      const std::lock_guard lock(mutex_);
      if (std::unique_ptr<Work>& kept = idle_[device]) return std::move(kept);
    }
    return std::make_unique<Work>();
  }
  void give_back(int device, std::unique_ptr<Work> work) {
    const std::lock_guard lock(mutex_);
    if (!idle_[device]) idle_[device] = std::move(work);
  }

  std::mutex mutex_;
  std::map<int, std::unique_ptr<Work>> idle_;
};

// The pool of one kind of work. Never destroyed: at the end of the process CUDA may end before it.
template <class Work>
DevicePool<Work>& pool_of() {
  static auto* const pool = [] {
    auto* const made = new DevicePool<Work>;
    IdleMemory::on_shortage([made] { made->free_idle(); });
    return made;
  }();
  return *pool;
}

}  // namespace sdftrack
