// SPDX-License-Identifier: MIT
// Masks and hints for an object's place, from numpy and back.
#pragma once

#include <algorithm>

#include "array.h"
#include "frame/image/pixel_mask.h"
#include "tracking/pose_hint.h"

namespace sdftrack::bindings {

// bool (height, width).
inline frame::PixelMask pixel_mask_from(const py::array& mask, const char* name, int width, int height) {
  const bool* from = borrow<bool>(mask, name, {height, width});
  frame::PixelMask out(width, height);
  std::copy(from, from + out.on.size(), out.on.begin());
  return out;
}
inline py::array_t<bool> mask_to_numpy(const frame::PixelMask& mask) {
  py::array_t<bool> out({mask.height, mask.width});
  std::transform(mask.on.begin(), mask.on.end(), out.mutable_data(), [](unsigned char v) { return v != 0; });
  return out;
}

// None: anywhere; (4, 4) float64: a pose; H x W uint8: a mask; (x, y, w, h): a box.
tracking::PoseHint pose_hint_from(const py::object& place, const Camera& camera);

}  // namespace sdftrack::bindings
