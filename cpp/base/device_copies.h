// SPDX-License-Identifier: MIT
// Values in the host's memory of which a GPU has the same, kept by whoever keeps them alike: what needs them
// there need not send them. No CUDA header is needed to include this.
#pragma once

#include <map>
#include <mutex>
#include <utility>

namespace sdftrack {

class DeviceCopies {
 public:
  static void add(const void* host, int device, const void* there) {
    const std::lock_guard lock(mutex());
    all()[{host, device}] = there;
  }
  static void remove(const void* host, int device) {
    const std::lock_guard lock(mutex());
    all().erase({host, device});
  }
  // nullptr: there is none.
  template <class T>
  static const T* find(const T* host, int device) {
    const std::lock_guard lock(mutex());
    const auto found = all().find({host, device});
    return found == all().end() ? nullptr : static_cast<const T*>(found->second);
  }

 private:
  using Key = std::pair<const void*, int>;
  static std::mutex& mutex() {
    static std::mutex one;
    return one;
  }
  static std::map<Key, const void*>& all() {
    static std::map<Key, const void*> one;
    return one;
  }
};

}  // namespace sdftrack
