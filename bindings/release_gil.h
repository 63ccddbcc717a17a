// SPDX-License-Identifier: MIT
// Work without the interpreter's lock, also while the interpreter ends.
#pragma once

#include <pybind11/pybind11.h>

#include <chrono>

#include "base/interrupt.h"

namespace sdftrack::bindings {

// Without the lock from construction to the end of the scope. In place of py::gil_scoped_release: when the
// interpreter ends, Python makes a daemon thread that asks for the lock exit by unwinding its stack, which
// C++ functions that do not expect it answer by aborting the process. Here such a thread rests instead, until
// the process is over.
class ReleaseGil {
 public:
  ReleaseGil() : state_(PyEval_SaveThread()) {}
  ~ReleaseGil() { take_back(state_); }
  ReleaseGil(const ReleaseGil&) = delete;
  ReleaseGil& operator=(const ReleaseGil&) = delete;

 private:
  friend class ReleaseGilUntilSignal;
  static void take_back(PyThreadState* state);
  PyThreadState* state_;
};

// The same around a call that may take seconds: where a signal's handler raises an exception, as that of
// Ctrl-C does, the call is broken off with it. Only the main thread runs handlers.
class ReleaseGilUntilSignal : private Interrupt {
 public:
  ReleaseGilUntilSignal() { this_threads_interrupt = this; }
  ~ReleaseGilUntilSignal() { this_threads_interrupt = nullptr; }

 private:
  void check() override;
  ReleaseGil release_;
  std::chrono::steady_clock::time_point last_look_ = std::chrono::steady_clock::now();
};

// Registers with the interpreter what is to be done when it ends. Once, while the module is loaded.
void watch_for_the_end();

}  // namespace sdftrack::bindings
