// SPDX-License-Identifier: MIT
// Allows one thread at a time in an object that works without the GIL.
#pragma once

#include <atomic>
#include <stdexcept>
#include <string>

namespace sdftrack::bindings {

// A thread's turn, from construction to the end of the scope. Take it before reading the object.
class Busy {
 public:
  Busy(std::atomic<bool>* flag, const char* what) : flag_(flag) {
    if (flag->exchange(true))
      throw std::runtime_error(std::string("this ") + what + " is in use by another thread; make one " +
                               what + " per thread");
  }
  ~Busy() { *flag_ = false; }
  Busy(const Busy&) = delete;
  Busy& operator=(const Busy&) = delete;

 private:
  std::atomic<bool>* flag_;
};

}  // namespace sdftrack::bindings
