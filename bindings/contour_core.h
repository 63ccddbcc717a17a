// SPDX-License-Identifier: MIT
// What the bindings of the contour tracker share.
#pragma once

#include <array>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "array.h"
#include "contour/tracker.h"
#include "release_gil.h"

namespace sdftrack::bindings {

// In the order of contour::ContourStatus.
inline constexpr std::array<const char*, 3> kContourStatus = {"ok", "weak", "lost"};

contour::RgbView color_view(const py::array& image);
// The flow of the part of the image with its corner at (x0, y0).
std::optional<contour::FlowView> flow_view(const std::optional<py::array>& flow, int x0, int y0,
                                           const contour::RgbView& image);

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

}  // namespace sdftrack::bindings
