// SPDX-License-Identifier: MIT
// A contour tracker and whose turn it is.
#pragma once

#include <atomic>

#include "busy.h"
#include "contour_options.h"
#include "release_gil.h"

namespace sdftrack::bindings {

struct ContourCore {
  contour::ContourTracker tracker;
  std::atomic<bool> busy{false};
  ContourCore(const py::dict& options, int device) : tracker(options_from(options), device) {}
};

// What `call` returns, without the interpreter's lock.
template <class Call>
auto unlocked(const Call& call) {
  const ReleaseGil release;
  return call();
}

}  // namespace sdftrack::bindings
