// SPDX-License-Identifier: MIT
// Long computations that their caller may break off.
#pragma once

namespace sdftrack {

// Asked by a computation now and then, on the thread that has called it. Throws to break it off.
class Interrupt {
 public:
  virtual void check() = 0;

 protected:
  Interrupt() = default;
  ~Interrupt() = default;
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;
};

// Of the calls of this thread; nullptr: they are not to be broken off. Helpers of a parallel loop have none.
inline thread_local Interrupt* this_threads_interrupt = nullptr;

// Between the parts of a computation that may take seconds. What it has changed so far must be valid.
inline void check_interrupt() {
  if (this_threads_interrupt) this_threads_interrupt->check();
}

}  // namespace sdftrack
