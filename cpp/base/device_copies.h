// SPDX-License-Identifier: MIT
// Host arrays with an equal copy on a GPU, registered by the code that keeps both equal, so that users of the
// copy need not send it. No CUDA header is needed to include this.
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
  // nullptr: no copy.
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
