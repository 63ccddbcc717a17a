// SPDX-License-Identifier: MIT
// Work without the interpreter's lock, also while the interpreter ends.
#pragma once

#include <pybind11/pybind11.h>

#include <chrono>

#include "base/interrupt.h"

namespace sdftrack::bindings {

// Releases the lock from construction to the end of the scope. It replaces py::gil_scoped_release: when the
// interpreter ends, Python unwinds the stack of a daemon thread that requests the lock. C++ functions that do
// not expect this abort the process. Here such a thread sleeps until the process ends.
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

// As ReleaseGil, around a call that may take seconds: if a signal's handler raises an exception, as for
// Ctrl-C, the call ends with this exception. Only the main thread runs handlers.
class ReleaseGilUntilSignal : private Interrupt {
 public:
  ReleaseGilUntilSignal() { this_threads_interrupt = this; }
  ~ReleaseGilUntilSignal() { this_threads_interrupt = nullptr; }

 private:
  void check() override;
  ReleaseGil release_;
  std::chrono::steady_clock::time_point last_look_ = std::chrono::steady_clock::now();
};

// Runs `call` without the interpreter's lock and returns its result.
template <class Release = ReleaseGil, class Call>
auto unlocked(const Call& call) {
  const Release release;
  return call();
}

// Registers the work at the interpreter's end. Called once, while the module is loaded.
void watch_for_the_end();

}  // namespace sdftrack::bindings
