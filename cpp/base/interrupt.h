// SPDX-License-Identifier: MIT
// Interruption of long computations by their caller.
#pragma once

namespace sdftrack {

// A computation calls check() now and then, on the thread of its caller. check() throws to end it.
class Interrupt {
 public:
  virtual void check() = 0;

 protected:
  Interrupt() = default;
  ~Interrupt() = default;
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;
};

// For the calls of this thread; nullptr: no interruption. Helper threads of a parallel loop have none.
inline thread_local Interrupt* this_threads_interrupt = nullptr;

// Called between the parts of a computation that may take seconds, when all data changed so far is valid.
inline void check_interrupt() {
  if (this_threads_interrupt) this_threads_interrupt->check();
}

}  // namespace sdftrack
