// SPDX-License-Identifier: MIT
// A contour tracker with the flag that it is in use.
#pragma once

#include <array>
#include <atomic>
#include <stdexcept>
#include <string_view>

#include "busy.h"
#include "contour_options.h"
#include "release_gil.h"

namespace sdftrack::bindings {

// In the order of contour::ContourStatus.
inline constexpr std::array<const char*, 3> kContourStatus = {"ok", "weak", "lost"};

struct ContourCore {
  contour::ContourTracker tracker;
  std::atomic<bool> busy{false};
  ContourCore(const py::dict& options, int device) : tracker(options_from(options), device) {}
};

// Pickles a part of a contour tracker as its state.
template <class Part>
auto pickled() {
  return py::pickle([](const Part& self) { return py::bytes(state_of(self)); },
                    [](const py::bytes& state) {
                      Part out;
                      if (!set_state(std::string_view(state), &out))
                        throw std::invalid_argument(
                            "state: expected a contour tracker of this version, got one of another version");
                      return out;
                    });
}

// Runs `call` without the interpreter's lock and returns its result.
template <class Call>
auto unlocked(const Call& call) {
  const ReleaseGil release;
  return call();
}

}  // namespace sdftrack::bindings
