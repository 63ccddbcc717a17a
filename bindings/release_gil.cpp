// SPDX-License-Identifier: MIT
#include "release_gil.h"

#include <atomic>
#include <chrono>
#include <exception>
#include <thread>

namespace sdftrack::bindings {

namespace {

std::atomic<bool> ending{false};
std::atomic<int> coming_back{0};  // threads that request the lock
std::thread::id ender;            // the thread that ends the interpreter; written before `ending`

// Threads that came back before `ending` was set get the lock first; later ones sleep.
void end() {
  ender = std::this_thread::get_id();
  ending = true;
  PyThreadState* const state = PyEval_SaveThread();
  while (coming_back > 0) std::this_thread::sleep_for(std::chrono::microseconds(100));
  PyEval_RestoreThread(state);
}

// Time between checks for signals. Handlers wait that long; taking the lock may also wait for other threads.
constexpr std::chrono::milliseconds kBetweenLooks{50};

}  // namespace

void ReleaseGilUntilSignal::check() {
  const auto now = std::chrono::steady_clock::now();
  if (now - last_look_ < kBetweenLooks) return;
  ReleaseGil::take_back(release_.state_);
  const bool raised = PyErr_CheckSignals() != 0;
  std::exception_ptr error;
  if (raised) error = std::make_exception_ptr(pybind11::error_already_set());
  release_.state_ = PyEval_SaveThread();
  last_look_ = std::chrono::steady_clock::now();
  if (error) std::rethrow_exception(error);
}

void ReleaseGil::take_back(PyThreadState* state) {
  ++coming_back;
  if (ending && std::this_thread::get_id() != ender) {
    --coming_back;
    for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
  }
  PyEval_RestoreThread(state);
  --coming_back;
}

void watch_for_the_end() {
  pybind11::module_::import("atexit").attr("register")(pybind11::cpp_function(&end));
}

}  // namespace sdftrack::bindings
